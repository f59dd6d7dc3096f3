#include "lib/noise/perlin.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace pileus {

namespace {

constexpr int kPeriod = 256;

constexpr std::array<uint8_t, kPeriod> kPublishedPermutation{
    151, 160, 137, 91,  90,  15,  131, 13,  201, 95,  96,  53,  194, 233, 7,   225, 140, 36,  103, 30,
    69,  142, 8,   99,  37,  240, 21,  10,  23,  190, 6,   148, 247, 120, 234, 75,  0,   26,  197, 62,
    94,  252, 219, 203, 117, 35,  11,  32,  57,  177, 33,  88,  237, 149, 56,  87,  174, 20,  125, 136,
    171, 168, 68,  175, 74,  165, 71,  134, 139, 48,  27,  166, 77,  146, 158, 231, 83,  111, 229, 122,
    60,  211, 133, 230, 220, 105, 92,  41,  55,  46,  245, 40,  244, 102, 143, 54,  65,  25,  63,  161,
    1,   216, 80,  73,  209, 76,  132, 187, 208, 89,  18,  169, 200, 196, 135, 130, 116, 188, 159, 86,
    164, 100, 109, 198, 173, 186, 3,   64,  52,  217, 226, 250, 124, 123, 5,   202, 38,  147, 118, 126,
    255, 82,  85,  212, 207, 206, 59,  227, 47,  16,  58,  17,  182, 189, 28,  42,  223, 183, 170, 213,
    119, 248, 152, 2,   44,  154, 163, 70,  221, 153, 101, 155, 167, 43,  172, 9,   129, 22,  39,  253,
    19,  98,  108, 110, 79,  113, 224, 232, 178, 185, 112, 104, 218, 246, 97,  228, 251, 34,  242, 193,
    238, 210, 144, 12,  191, 179, 162, 241, 81,  51,  145, 235, 249, 14,  239, 107, 49,  192, 214, 31,
    181, 199, 106, 157, 184, 84,  204, 176, 115, 121, 50,  45,  127, 4,   150, 254, 138, 236, 205, 93,
    222, 114, 67,  29,  24,  72,  243, 141, 128, 195, 78,  66,  215, 61,  156, 180};

/// The twelve midpoints of a cube's edges, four of them twice, so that four bits of the hash pick one.
constexpr std::array<std::array<int8_t, 3>, 16> kGradients{{{1, 1, 0},
                                                            {-1, 1, 0},
                                                            {1, -1, 0},
                                                            {-1, -1, 0},
                                                            {1, 0, 1},
                                                            {-1, 0, 1},
                                                            {1, 0, -1},
                                                            {-1, 0, -1},
                                                            {0, 1, 1},
                                                            {0, -1, 1},
                                                            {0, 1, -1},
                                                            {0, -1, -1},
                                                            {1, 1, 0},
                                                            {0, -1, 1},
                                                            {-1, 1, 0},
                                                            {0, -1, -1}}};

uint64_t next_split_mix(uint64_t& state) {
  state += 0x9e3779b97f4a7c15u;
  uint64_t z = state;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

/// One coordinate, split into the lattice cell (wrapped to the period) and the place in it.
struct Cell {
  int index;     ///< 0 .. kPeriod - 1
  double place;  ///< 0 .. 1

  explicit Cell(double x) {
    const double whole = std::floor(x);
    // Wrapped while still floating: the conversion to int then cannot overflow, and every step is exact.
    index = int(whole - kPeriod * std::floor(whole / kPeriod));
    place = x - whole;
  }
  double weight() const { return place * place * place * (place * (place * 6 - 15) + 10); }
  double weight_slope() const { return 30 * place * place * (1 - place) * (1 - place); }
};

/// perlin2002's own order of operations, so that values agree with the reference to the last bit; `axis` is
/// the one that the weight t depends on.
NoiseSample mix(int axis, double t, double t_slope, const NoiseSample& a, const NoiseSample& b) {
  NoiseSample mixed{a.value + t * (b.value - a.value), a.gradient + t * (b.gradient - a.gradient)};
  mixed.gradient[axis] += t_slope * (b.value - a.value);
  return mixed;
}

NoiseSample perlin(const std::array<uint8_t, kPeriod>& permutation, const Vec3d& p) {
  const Cell x(p.x), y(p.y), z(p.z);

  // The ramp of a corner (i, j, k in {0, 1}): its gradient times the way from the corner to the point.
  const auto corner = [&](int i, int j, int k) {
    const int column = permutation[size_t(x.index + i) % kPeriod];
    const int row = permutation[size_t(column + y.index + j) % kPeriod];
    const auto& g = kGradients[permutation[size_t(row + z.index + k) % kPeriod] % kGradients.size()];
    return NoiseSample{
        double(g[0]) * (x.place - i) + double(g[1]) * (y.place - j) + double(g[2]) * (z.place - k),
        Vec3d(g[0], g[1], g[2])};
  };
  const double u = x.weight(), v = y.weight(), w = z.weight();
  const double du = x.weight_slope(), dv = y.weight_slope(), dw = z.weight_slope();
  const auto edge = [&](int j, int k) { return mix(0, u, du, corner(0, j, k), corner(1, j, k)); };
  const auto face = [&](int k) { return mix(1, v, dv, edge(0, k), edge(1, k)); };
  return mix(2, w, dw, face(0), face(1));
}

NoiseTables kernel_tables(const std::array<uint8_t, kPeriod>& permutation) {
  NoiseTables tables;
  const auto hash = [&](size_t n) { return permutation[n % kPeriod]; };
  for (size_t n = 0; n < tables.hash.size(); ++n) tables.hash[n] = hash(n);
  for (size_t n = 0; n < tables.gradient.size(); ++n) {
    tables.gradient[n] = uint8_t(hash(n) % kGradients.size());
  }
  return tables;
}

/// A box around its centre, its half extents rounded up.
struct CentredBox {
  Vec3d centre, half;

  explicit CentredBox(const Box3d& box) : centre(0.5 * (box.min + box.max)) {
    for (int axis = 0; axis < 3; ++axis) {
      const double rounding = 4e-16 * std::max(std::fabs(box.min[axis]), std::fabs(box.max[axis]));
      half[axis] = std::max(box.max[axis] - centre[axis], centre[axis] - box.min[axis]) + rounding;
    }
  }
};

}  // namespace

PerlinNoise::PerlinNoise(uint64_t seed) : m_permutation(kPublishedPermutation) {
  if (seed != 0) {
    for (size_t left = m_permutation.size(); left > 1; --left) {
      // 64 random bits against at most 256 choices: the modulo's bias is below 2^-55.
      std::swap(m_permutation[left - 1], m_permutation[next_split_mix(seed) % left]);
    }
  }
  m_tables = kernel_tables(m_permutation);
}

double PerlinNoise::value(const Vec3d& p) const {
  return perlin(m_permutation, p).value;
}

NoiseSample PerlinNoise::sample(const Vec3d& p) const {
  return perlin(m_permutation, p);
}

Interval PerlinNoise::bound(const Box3d& box) const {
  constexpr Interval kEverywhere{-kPerlinBound, kPerlinBound};
  const CentredBox b(box);
  const double reach = std::max({b.half.x, b.half.y, b.half.z});
  if (!(kPerlinCubeSlope * reach < 2 * kPerlinBound)) return kEverywhere;
  const NoiseSample centre = sample(b.centre);
  const Vec3d& slope = centre.gradient;
  const double tangent =
      std::fabs(slope.x) * b.half.x + std::fabs(slope.y) * b.half.y + std::fabs(slope.z) * b.half.z;
  const double radius =
      kNoiseMargin + std::min({kPerlinCubeSlope * reach, kPerlinSlope * (b.half.x + b.half.y + b.half.z),
                               tangent + 0.5 * kPerlinCubeCurvature * reach * reach});
  return intersection({centre.value - radius, centre.value + radius}, kEverywhere);
}

}  // namespace pileus
