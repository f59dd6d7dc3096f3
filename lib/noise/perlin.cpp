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
template <class Real>
struct Cell {
  int index;   ///< 0 .. kPeriod - 1
  Real place;  ///< 0 .. 1

  explicit Cell(Real x) {
    const Real whole = std::floor(x);
    // Wrapped while still floating: the conversion to int then cannot overflow, and every step is exact.
    index = int(whole - Real(kPeriod) * std::floor(whole / Real(kPeriod)));
    place = x - whole;
  }
};

template <class Real>
Real fade(Real t) {
  return t * t * t * (t * (t * 6 - 15) + 10);
}

/// perlin2002's own order of operations, so that values agree with the reference to the last bit.
template <class Real>
Real perlin_lerp(Real t, Real a, Real b) {
  return a + t * (b - a);
}

template <class Real>
Real perlin(const std::array<uint8_t, kPeriod>& permutation, const Imath::Vec3<Real>& p) {
  const Cell<Real> x(p.x), y(p.y), z(p.z);

  // The ramp of a corner (i, j, k in {0, 1}): its gradient times the way from the corner to the point.
  const auto corner = [&](int i, int j, int k) {
    const int column = permutation[size_t(x.index + i) % kPeriod];
    const int row = permutation[size_t(column + y.index + j) % kPeriod];
    const auto& g = kGradients[permutation[size_t(row + z.index + k) % kPeriod] % kGradients.size()];
    return Real(g[0]) * (x.place - Real(i)) + Real(g[1]) * (y.place - Real(j)) +
           Real(g[2]) * (z.place - Real(k));
  };
  const auto edge = [&](Real u, int j, int k) { return perlin_lerp(u, corner(0, j, k), corner(1, j, k)); };

  const Real u = fade(x.place), v = fade(y.place), w = fade(z.place);
  const Real below = perlin_lerp(v, edge(u, 0, 0), edge(u, 1, 0));
  const Real above = perlin_lerp(v, edge(u, 0, 1), edge(u, 1, 1));
  return perlin_lerp(w, below, above);
}

}  // namespace

PerlinNoise::PerlinNoise(uint64_t seed) : m_permutation(kPublishedPermutation) {
  if (seed == 0) return;
  for (size_t left = m_permutation.size(); left > 1; --left) {
    // 64 random bits against at most 256 choices: the modulo's bias is below 2^-55.
    std::swap(m_permutation[left - 1], m_permutation[next_split_mix(seed) % left]);
  }
}

double PerlinNoise::value(const Vec3d& p) const {
  return perlin(m_permutation, p);
}

float PerlinNoise::value(const Vec3f& p) const {
  return perlin(m_permutation, p);
}

}  // namespace pileus
