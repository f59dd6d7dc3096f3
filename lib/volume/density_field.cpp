#include "lib/volume/density_field.h"

#include <algorithm>
#include <cmath>

#include "lib/core/error.h"
#include "lib/math/affine.h"
#include "lib/math/transmittance.h"

namespace pileus {
namespace {

/// Position of t within the piece, 0 .. 1.
double local_parameter(const DensityPiece& piece, double t) {
  const double h = piece.t1 - piece.t0;
  return h > 0.0 ? std::clamp((t - piece.t0) / h, 0.0, 1.0) : 0.0;
}

}  // namespace

const Affine& DensityField::index_from_world() const {
  PILEUS_CHECK(has_bricks());
  static const Affine identity;
  return identity;
}

std::span<const Affine> DensityField::places() const {
  if (!has_bricks()) return {};
  return {&index_from_world(), 1};
}

double density_at(const DensityPiece& piece, double t) {
  if (piece.rate != 0.0) return piece.rho[0] * std::exp(piece.rate * (t - piece.t0));
  const double u = local_parameter(piece, t), v = 1.0 - u;
  const auto& b = piece.rho;
  return v * v * v * b[0] + 3.0 * u * v * (v * b[1] + u * b[2]) + u * u * u * b[3];
}

double column_to(const DensityPiece& piece, double t) {
  const double s = std::clamp(t, piece.t0, piece.t1) - piece.t0;
  if (piece.rate != 0.0) {
    // From the denser end, so that the exponent is never positive.
    const double denser = piece.rho[0] * std::exp(std::max(0.0, piece.rate * s));
    return denser * s * phi1(std::abs(piece.rate) * s);
  }
  // The integral of a cubic in Bernstein form is a quartic whose control values are the running sums of the
  // cubic's, times h / 4; its first control value is 0, so every term has the factor u.
  const double u = local_parameter(piece, t), v = 1.0 - u;
  const auto& b = piece.rho;
  const double c1 = b[0], c2 = c1 + b[1], c3 = c2 + b[2], c4 = c3 + b[3];
  const double quartic = 4.0 * v * v * v * c1 + 6.0 * u * v * v * c2 + 4.0 * u * u * v * c3 + u * u * u * c4;
  return 0.25 * s * quartic;
}

}  // namespace pileus
