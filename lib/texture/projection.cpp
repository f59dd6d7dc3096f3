#include "lib/texture/projection.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pileus {
namespace {

/// Stands for lengths of 0, so that gradients stay finite.
constexpr double kTiny = 1e-150;

/// The way around the y axis.
struct Turn {
  double u;     ///< 1/2 towards +z, growing towards +x
  double rho;   ///< distance from the axis
  double x, z;  ///< unit vector away from the axis
  Vec3d du;
};

Turn turn_of(const Vec3d& p) {
  const double rho = std::hypot(p.x, p.z);
  const double x = rho > 0.0 ? p.x / rho : 0.0, z = rho > 0.0 ? p.z / rho : 1.0;
  const double steepness = 0.5 * std::numbers::inv_pi / std::max(rho, kTiny);
  return {0.5 + 0.5 * std::numbers::inv_pi * std::atan2(x, z), rho, x, z, Vec3d(z, 0, -x) * steepness};
}

PicturePlace spherical(const Vec3d& p) {
  const Turn turn = turn_of(p);
  const double r = std::max(std::hypot(turn.rho, p.y), kTiny);
  const double along = p.y / r, across = turn.rho / r;  // sine and cosine of the latitude
  const Vec3d dv = Vec3d(along * turn.x, -across, along * turn.z) * (std::numbers::inv_pi / r);
  return {{turn.u, std::numbers::inv_pi * std::atan2(turn.rho, p.y)}, turn.du, dv};
}

}  // namespace

PicturePlace project(Projection projection, const Vec3d& p) {
  switch (projection) {
    case Projection::planar:
      break;
    case Projection::spherical:
      return spherical(p);
    case Projection::cylindrical: {
      const Turn turn = turn_of(p);
      return {{turn.u, 0.5 - p.y}, turn.du, {0, -1, 0}};
    }
  }
  return {{0.5 + p.x, 0.5 + p.z}, {1, 0, 0}, {0, 0, 1}};
}

}  // namespace pileus
