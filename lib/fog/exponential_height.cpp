#include "lib/fog/exponential_height.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/math/transmittance.h"

namespace pileus {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kGone = 746.0;  ///< exp(-kGone) is 0

/// -ln(1 - z) / z: 1 at 0, +inf from z = 1 on.
double log1p_ratio(double z) {
  if (z >= 1.0) return kInfinity;
  return std::abs(z) < 1e-300 ? 1.0 : -std::log1p(-z) / z;
}

}  // namespace

double height_extinction(const HeightProfile& profile, double z) {
  return profile.extinction * std::exp(-z / profile.scale);
}

double height_depth(const HeightProfile& profile, double z0, double rise, double s) {
  if (!(s > 0.0) || !(profile.extinction > 0.0)) return 0.0;
  const double climb = rise != 0.0 ? rise * s : 0.0;
  const double lowest = std::min(z0, std::max(z0 + climb, 0.0)) / profile.scale;
  if (lowest >= kGone) return 0.0;
  const double densest = profile.extinction * std::exp(-lowest);
  const double x = std::abs(climb) / profile.scale;
  // Long climbs leave behind all there is: s phi1(x) = opacity(x) scale / |rise|.
  const double length = x < 0.5 ? s * phi1(x) : opacity_from_tau(x) * (profile.scale / std::abs(rise));
  return densest * length;
}

double height_depth_inverse(const HeightProfile& profile, double z0, double rise, double tau) {
  if (!(tau > 0.0)) return 0.0;
  if (!(profile.extinction > 0.0)) return kInfinity;
  const double here = height_extinction(profile, z0);
  const double rate = rise / profile.scale;  // tau = here (1 - exp(-rate s)) / rate
  if (here > 0.0 && std::abs(rate) * tau < 1e15 * here) {
    return tau / here * log1p_ratio(rate * (tau / here));
  }
  if (rate >= 0.0) return kInfinity;
  // Far above: the density here may be 0, its logarithm is not.
  const double log_ratio =
      std::log(-rate) + std::log(tau) - std::log(profile.extinction) + z0 / profile.scale;
  return (log_ratio + std::log1p(std::exp(-log_ratio))) / -rate;
}

}  // namespace pileus
