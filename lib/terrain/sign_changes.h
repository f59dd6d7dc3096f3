#pragma once

#include <array>

namespace pileus {

/// Where a height difference g on [0, 1] passes from > 0 to <= 0 or back, ascending: at least one place if
/// its ends differ in that.
struct SignChanges {
  int count = 0;
  std::array<double, 6> s{};
};

/// Of a quadratic, by its Bernstein coefficients. Sums have terms of one sign only, so that all roots are in
/// [0, 1] and keep their digits.
SignChanges sign_changes(std::array<double, 3> g);

/// Of a polynomial of degree 6. Stretches are halved until the signs of their coefficients change at most
/// once: with none there is no root, with one there is one. Where stretches get as short as rounding, roots
/// that are closer than that count as none.
SignChanges sign_changes(const std::array<double, 7>& g);

}  // namespace pileus
