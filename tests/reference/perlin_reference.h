#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "lib/math/vec.h"

namespace pileus::reference {

/// Improved noise as perlin2002 words it, slow and in double precision: the eight corners' ramps, weighted.
/// Gradients come from the bits of the hash, not from a table.
class SlowPerlin {
 public:
  double value(double x, double y, double z) const {
    double sum = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      const double cx = std::floor(x) + (corner & 1), cy = std::floor(y) + (corner >> 1 & 1),
                   cz = std::floor(z) + (corner >> 2);
      sum +=
          weight(x - cx) * weight(y - cy) * weight(z - cz) * ramp(hash(cx, cy, cz), x - cx, y - cy, z - cz);
    }
    return sum;
  }

  /// The gradient of the lattice point (cx, cy, cz): what its ramp grows by along each axis.
  Vec3d corner_gradient(double cx, double cy, double cz) const {
    const int h = hash(cx, cy, cz);
    return Vec3d(ramp(h, 1, 0, 0), ramp(h, 0, 1, 0), ramp(h, 0, 0, 1));
  }

 private:
  static double weight(double way) {
    const double t = 1.0 - std::fabs(way);
    return 6 * std::pow(t, 5) - 15 * std::pow(t, 4) + 10 * std::pow(t, 3);
  }

  int hash(double cx, double cy, double cz) const {
    const auto wrapped = [](double c) { return int(c - 256.0 * std::floor(c / 256.0)); };
    int h = m_table[size_t(wrapped(cx))];
    h = m_table[size_t(wrapped(h + cy))];
    return m_table[size_t(wrapped(h + cz))];
  }

  /// Bits 0 and 1 of the hash are the signs of the two terms; bits 2 and 3 pick their axes.
  static double ramp(int hash, double x, double y, double z) {
    const int h = hash % 16;
    double first = h < 8 ? x : y;
    double second = h < 4 ? y : z;
    if (h == 12 || h == 14) second = x;
    if (h & 1) first = -first;
    if (h & 2) second = -second;
    return first + second;
  }

  static constexpr std::array<int, 256> m_table{
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
};

}  // namespace pileus::reference
