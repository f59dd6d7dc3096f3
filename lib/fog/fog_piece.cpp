#include "lib/fog/fog_piece.h"

#include <algorithm>
#include <cmath>

#include "lib/fog/fade.h"
#include "lib/math/transmittance.h"

namespace pileus {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Where nothing is multiplied by infinity.
double product(double a, double b) {
  return a == 0.0 || b == 0.0 ? 0.0 : a * b;
}

Rgb plain_source(const FogPiece& piece, double tau) {
  return piece.colour_slope == Rgb(0.0) ? piece.colour : piece.colour + piece.colour_slope * tau;
}

/// A source in sunlight: colour sigma exp(-sun_depth) times the integral of exp(-(sigma + sun_slope) s).
Rgb sunlit_light(const FogPiece& piece, double s) {
  if (!(piece.sigma > 0.0) || !std::isfinite(piece.sun_depth) || !(s > 0.0)) return Rgb(0.0);
  const double growth = piece.sigma + piece.sun_slope, change = product(growth, s);
  const double dimmed = transmittance(std::max(piece.sun_depth + std::min(change, 0.0), 0.0));
  const double depth = std::abs(change) < 0.5
                           ? piece.sigma * s * phi1(std::abs(change))
                           : opacity_from_tau(std::abs(change)) * (piece.sigma / std::abs(growth));
  return dimmed > 0.0 ? piece.colour * (dimmed * depth) : Rgb(0.0);
}

}  // namespace

double extinction_at(const FogPiece& piece, double s) {
  switch (piece.law) {
    case FogPiece::Law::constant:
      return piece.sigma;
    case FogPiece::Law::linear:
      return std::max(piece.sigma + piece.slope * s, 0.0);
    case FogPiece::Law::height:
      return height_extinction(piece.profile, piece.z0 + product(piece.rise, s));
    case FogPiece::Law::fade:
      return s < piece.length ? 1.0 / (piece.length - s) : kInfinity;
  }
  return 0.0;
}

double depth_to(const FogPiece& piece, double s) {
  switch (piece.law) {
    case FogPiece::Law::constant:
      return product(piece.sigma, s);
    case FogPiece::Law::linear:
      return product(piece.sigma + 0.5 * product(piece.slope, s), s);
    case FogPiece::Law::height:
      return height_depth(piece.profile, piece.z0, piece.rise, s);
    case FogPiece::Law::fade:
      return s < piece.length ? -std::log1p(-s / piece.length) : kInfinity;
  }
  return 0.0;
}

double depth_inverse(const FogPiece& piece, double tau) {
  if (!(tau > 0.0)) return 0.0;
  switch (piece.law) {
    case FogPiece::Law::constant:
      return tau / piece.sigma;
    case FogPiece::Law::linear: {
      // sigma s + slope s^2 / 2 = tau; the root that does not cancel.
      const double square = piece.sigma * piece.sigma + 2.0 * piece.slope * tau;
      return square < 0.0 ? kInfinity : 2.0 * tau / (piece.sigma + std::sqrt(square));
    }
    case FogPiece::Law::height:
      return height_depth_inverse(piece.profile, piece.z0, piece.rise, tau);
    case FogPiece::Law::fade:
      return piece.length * opacity_from_tau(tau);
  }
  return 0.0;
}

double depth_bend(const FogPiece& piece, double s0, double s1) {
  const double depth0 = depth_to(piece, s0), depth1 = depth_to(piece, s1);
  if (!std::isfinite(depth1)) return kInfinity;
  // A convex function stays above the lines from its ends through its middle.
  return 2.0 * std::abs(depth_to(piece, 0.5 * (s0 + s1)) - 0.5 * (depth0 + depth1));
}

Rgb source_at(const FogPiece& piece, double s) {
  if (piece.source == FogPiece::Source::sunlit) {
    return piece.colour * transmittance(piece.sun_depth + product(piece.sun_slope, s));
  }
  return plain_source(piece, depth_to(piece, s));
}

Rgb light_per_loss(const FogPiece& piece, double s) {
  if (piece.source != FogPiece::Source::mean || piece.colour_slope == Rgb(0.0)) return source_at(piece, s);
  const double tau = depth_to(piece, s);
  return piece.colour + piece.colour_slope * (0.5 * (std::expm1(tau) + tau));
}

Rgb light_to(const FogPiece& piece, double s) {
  if (piece.source == FogPiece::Source::sunlit) return sunlit_light(piece, s);
  const double tau = depth_to(piece, s);
  if (piece.colour_slope == Rgb(0.0)) return piece.colour * opacity_from_tau(tau);
  const Rgb far_end = plain_source(piece, tau);
  if (piece.source == FogPiece::Source::mean) return 0.5 * (piece.colour + far_end) * opacity_from_tau(tau);
  const SourceWeights<double> weights = source_weights(tau);
  return weights.front * piece.colour + weights.back * far_end;
}

FogPiece cut_before(const FogPiece& piece, double from) {
  FogPiece rest = piece;
  const double s = from - piece.t0;
  if (!(s > 0.0)) return rest;
  rest.t0 = from;
  rest.colour = piece.source == FogPiece::Source::sunlit ? piece.colour : source_at(piece, s);
  rest.sun_depth = piece.sun_depth + product(piece.sun_slope, s);
  rest.sigma = piece.law == FogPiece::Law::linear ? extinction_at(piece, s) : piece.sigma;
  rest.z0 = piece.z0 + product(piece.rise, s);
  rest.length = std::max(piece.length - s, 0.0);
  return rest;
}

}  // namespace pileus
