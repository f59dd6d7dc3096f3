#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace pileus {

/// y = factor * x^exponent: a straight line where both axes are logarithmic. The error of a method of order p
/// follows one in its step, and its cost follows another.
struct PowerLaw {
  double factor = 1.0;
  double exponent = 0.0;
  size_t points = 0;  ///< that it was fitted to

  double at(double x) const;
  /// The x at which the law has the value y; exponent != 0.
  double solve(double y) const;
};

/// The least-squares line of log y against log x. Points that have no logarithm (not above 0, not finite) are
/// left out.
/// returns: none where fewer than two different x remain
std::optional<PowerLaw> fit_power_law(std::span<const double> x, std::span<const double> y);

}  // namespace pileus
