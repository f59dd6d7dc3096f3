#include "lib/noise/perlin.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "lib/core/error.h"

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

using Gradient = std::array<int, 3>;

/// The number of an edge gradient: its first place in the table.
uint8_t gradient_number(const Gradient& g) {
  for (size_t n = 0; n < kGradients.size(); ++n) {
    if (kGradients[n][0] == g[0] && kGradients[n][1] == g[1] && kGradients[n][2] == g[2]) return uint8_t(n);
  }
  PILEUS_CHECK(false);
}

/// One corner further, 60 degrees around the cube's diagonal n, across which g stands:
///   cos 60 g + sin 60 (n / |n|) x g = (g + n x g) / 2
Gradient next_corner(const Gradient& g, const Gradient& n) {
  const Gradient cross{n[1] * g[2] - n[2] * g[1], n[2] * g[0] - n[0] * g[2], n[0] * g[1] - n[1] * g[0]};
  return {(g[0] + cross[0]) / 2, (g[1] + cross[1]) / 2, (g[2] + cross[2]) / 2};
}

/// Numbers of the gradients on the walk of a lattice point: bits 0 to 3 of its hash tell the first one, bits
/// 4 and 5 which of the four diagonals across it the walk goes around.
std::array<uint8_t, kTurnSteps> gradient_walk(int hash) {
  const auto& start = kGradients[size_t(hash % 16)];
  Gradient g{start[0], start[1], start[2]}, diagonal;
  int sign = hash & 16 ? 1 : -1;
  for (size_t axis = 0; axis < 3; ++axis) {
    if (g[axis] == 0) {
      diagonal[axis] = hash & 32 ? 1 : -1;
    } else {
      diagonal[axis] = sign * g[axis];  // the two terms of dot(diagonal, g) cancel
      sign = -sign;
    }
  }
  std::array<uint8_t, kTurnSteps> walk;
  for (uint8_t& number : walk) {
    number = gradient_number(g);
    g = next_corner(g, diagonal);
  }
  walk[0] = uint8_t(hash % 16);
  return walk;
}

NoiseTables kernel_tables(const std::array<uint8_t, kPeriod>& permutation) {
  NoiseTables tables;
  for (size_t n = 0; n < tables.gradient[0].size(); ++n) {
    const auto walk = gradient_walk(permutation[n % kPeriod]);
    for (size_t step = 0; step < kTurnSteps; ++step) tables.gradient[step][n] = walk[step];
  }
  for (size_t n = 0; n < tables.hash.size(); ++n) {
    tables.hash[n] = permutation[n % kPeriod];
    tables.hash_pair[n] = permutation[n % kPeriod] | permutation[(n + 1) % kPeriod] << 8;
    for (size_t step = 0; step < kTurnSteps; ++step) {
      const auto& gradient = tables.gradient[step];
      tables.gradient_pair[step][n] = int32_t(uint32_t(gradient[n]) << 24 | uint32_t(gradient[n + 1]) << 8);
    }
  }
  return tables;
}

/// One coordinate, split into the lattice cell and the place in it.
struct Cell {
  size_t corner[2];  ///< lattice coordinates below and above, wrapped to 0 .. kPeriod - 1
  double place;      ///< 0 .. 1

  Cell(double x, int period) {
    const double whole = std::floor(x);
    place = x - whole;
    for (int k = 0; k < 2; ++k) {
      double at = whole + k;
      if (period > 0) at = std::fmod(at, period);
      // Wrapped while still floating: the conversion then cannot overflow, and every step is exact.
      if (at < 0 && period > 0) at += period;
      corner[k] = size_t(at - kPeriod * std::floor(at / kPeriod));
    }
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

}  // namespace

NoiseTurn noise_turn(double revolutions) {
  const double steps = kTurnSteps * (revolutions - std::floor(revolutions));
  const int from = std::min(int(steps), kTurnSteps - 1);
  return {from, (from + 1) % kTurnSteps, float(steps - from)};
}

PerlinNoise::PerlinNoise(uint64_t seed) : m_permutation(kPublishedPermutation) {
  if (seed != 0) {
    for (size_t left = m_permutation.size(); left > 1; --left) {
      // 64 random bits against at most 256 choices: the modulo's bias is below 2^-55.
      std::swap(m_permutation[left - 1], m_permutation[next_split_mix(seed) % left]);
    }
  }
  m_tables = kernel_tables(m_permutation);
}

double PerlinNoise::value(const Vec3d& p, const NoiseVariant& variant) const {
  return sample(p, variant).value;
}

NoiseSample PerlinNoise::sample(const Vec3d& p, const NoiseVariant& variant) const {
  const Cell x(p.x, variant.period.x), y(p.y, variant.period.y), z(p.z, variant.period.z);

  // The ramp of a corner (i, j, k in {0, 1}): its gradient times the way from the corner to the point.
  const auto corner = [&](int i, int j, int k) {
    const size_t column = m_permutation[x.corner[i]];
    const size_t row = m_permutation[(column + y.corner[j]) % kPeriod];
    const Vec3d g = gradient((row + z.corner[k]) % kPeriod, variant.turn);
    return NoiseSample{g.x * (x.place - i) + g.y * (y.place - j) + g.z * (z.place - k), g};
  };
  const double u = x.weight(), v = y.weight(), w = z.weight();
  const double du = x.weight_slope(), dv = y.weight_slope(), dw = z.weight_slope();
  const auto edge = [&](int j, int k) { return mix(0, u, du, corner(0, j, k), corner(1, j, k)); };
  const auto face = [&](int k) { return mix(1, v, dv, edge(0, k), edge(1, k)); };
  return mix(2, w, dw, face(0), face(1));
}

Vec3d PerlinNoise::gradient(size_t index, const NoiseTurn& turn) const {
  const auto of_step = [&](int step) {
    const auto& g = kGradients[m_tables.gradient[size_t(step)][index]];
    return Vec3d(g[0], g[1], g[2]);
  };
  const Vec3d from = of_step(turn.from);
  return turn.share == 0 ? from : from + double(turn.share) * (of_step(turn.to) - from);
}

}  // namespace pileus
