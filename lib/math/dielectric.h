#pragma once

#include <cmath>
#include <optional>

#include "lib/math/neumaier_sum.h"
#include "lib/math/two_product.h"
#include "lib/math/vec.h"

namespace pileus {

// A smooth surface between two clear media. `eta` is the refractive index of the far side divided by that of
// the viewer's side, `cosine` that of the angle between the normal and the viewer, 0 .. 1. ref: METHODS 12

/// (eta cos_t)^2 = cosine^2 + eta^2 - 1, with t the refracted direction: negative where all light is
/// reflected. Both squares are kept exactly: the sign is right to the last bit of both arguments, and an eta
/// near 1 loses nothing.
inline double squared_refracted_cosine(double cosine, double eta) {
  const TwoProduct<double> c2 = two_product(cosine, cosine), eta2 = two_product(eta, eta);
  NeumaierSum<double> sum;
  for (const double term : {eta2.value, -1.0, c2.value, eta2.error, c2.error}) sum.add(term);
  return sum.value();
}

/// Share of unpolarised light that the surface reflects, 0 .. 1: Fresnel's equations with the differences
/// factored, so that eta near 1 and Brewster's angle keep their digits.
///   r_s = (1 - eta^2) / (c + q)^2,  r_p = (eta^2 - 1) (eta^2 c^2 - s^2) / (eta^2 c + q)^2,  q = eta cos_t
inline double fresnel_reflectance(double cosine, double eta) {
  const double q2 = squared_refracted_cosine(cosine, eta);
  if (!(q2 > 0.0)) return 1.0;
  const double q = std::sqrt(q2), step = (eta - 1.0) * (eta + 1.0);
  const double s2 = (1.0 - cosine) * (1.0 + cosine), eta_c = eta * cosine;
  const double across = cosine + q, along = eta * eta_c + q;
  const double r_s = step / (across * across);
  const double r_p = step * (eta_c * eta_c - s2) / (along * along);
  return 0.5 * (r_s * r_s + r_p * r_p);
}

/// Where the viewer's ray goes on behind the surface; nowhere where all light is reflected.
///   n, wo: unit vectors, dot(n, wo) >= 0; wo towards the viewer
inline std::optional<Vec3d> refracted(const Vec3d& n, const Vec3d& wo, double eta) {
  const double cosine = dot(n, wo), q2 = squared_refracted_cosine(cosine, eta);
  if (!(q2 > 0.0)) return std::nullopt;
  // Snell: what is tangential shrinks by eta.
  return normalize((cosine - std::sqrt(q2)) * n - wo);
}

/// The mirror image of a direction that leaves a surface.
inline Vec3d mirrored(const Vec3d& n, const Vec3d& w) {
  return normalize(2.0 * dot(n, w) * n - w);
}

}  // namespace pileus
