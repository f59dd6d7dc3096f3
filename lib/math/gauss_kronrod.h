#pragma once

#include <array>
#include <cstddef>

namespace pileus {

/// The Gauss–Kronrod pair of 3 and 7 points on [0, 1]: the 7-point sum is the value (exact for polynomials of
/// degree 11), its distance to the 3-point sum (degree 5) the error estimate, which is far on the safe side
/// where the integrand is smooth.
struct GaussKronrod7 {
  static constexpr size_t kPoints = 7;

  struct Node {
    double x;        ///< abscissa in (0, 1)
    double kronrod;  ///< weight of the 7-point rule
    double gauss;    ///< weight of the embedded 3-point rule
  };

  static constexpr std::array<Node, kPoints> kNodes = [] {
    // Abscissae and weights for [-1, 1], mapped to [0, 1].
    constexpr double x[4] = {0.96049126870802028342, 0.77459666924148337704, 0.43424374934680255800, 0.0};
    constexpr double kronrod[4] = {0.10465622602646726519, 0.26848808986833344073, 0.40139741477596222291,
                                   0.45091653865847414235};
    constexpr double gauss[4] = {0.0, 5.0 / 9.0, 0.0, 8.0 / 9.0};
    std::array<Node, kPoints> nodes{};
    for (size_t i = 0; i < kPoints; ++i) {
      const size_t k = i < 4 ? i : 6 - i;
      const double sign = i < 3 ? -1.0 : 1.0;
      nodes[i] = {0.5 + 0.5 * sign * x[k], 0.5 * kronrod[k], 0.5 * gauss[k]};
    }
    return nodes;
  }();
};

}  // namespace pileus
