#include "pileus/accuracy/power_law.h"

#include <cmath>

#include "lib/core/error.h"

namespace pileus {
namespace {

bool has_logarithm(double value) {
  return value > 0.0 && std::isfinite(value);
}

}  // namespace

double PowerLaw::at(double x) const {
  return factor * std::pow(x, exponent);
}

double PowerLaw::solve(double y) const {
  return std::pow(y / factor, 1.0 / exponent);
}

std::optional<PowerLaw> fit_power_law(std::span<const double> x, std::span<const double> y) {
  PILEUS_CHECK(x.size() == y.size());
  size_t count = 0;
  double mean_x = 0.0, mean_y = 0.0;
  for (size_t i = 0; i < x.size(); ++i) {
    if (!has_logarithm(x[i]) || !has_logarithm(y[i])) continue;
    ++count;
    mean_x += (std::log(x[i]) - mean_x) / double(count);
    mean_y += (std::log(y[i]) - mean_y) / double(count);
  }
  double variance = 0.0, covariance = 0.0;
  for (size_t i = 0; i < x.size(); ++i) {
    if (!has_logarithm(x[i]) || !has_logarithm(y[i])) continue;
    const double dx = std::log(x[i]) - mean_x;
    variance += dx * dx;
    covariance += dx * (std::log(y[i]) - mean_y);
  }
  constexpr double kSameX = 1e-20;  // what rounding leaves of a variance of 0
  if (count < 2 || variance < kSameX) return std::nullopt;
  const double exponent = covariance / variance;
  return PowerLaw{std::exp(mean_y - exponent * mean_x), exponent, count};
}

}  // namespace pileus
