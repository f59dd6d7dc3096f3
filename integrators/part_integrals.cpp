#include "integrators/part_integrals.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/math/lerp.h"
#include "lib/math/transmittance.h"

namespace pileus {
namespace {

bool is_absent(const DensityPiece& piece) {
  return !(piece.t0 < piece.t1);
}

/// The longer half axis of the ellipse around [-1, 1] with this sum of half axes.
double long_axis(double ellipse) {
  return 0.5 * (ellipse + 1.0 / ellipse);
}

}  // namespace

void PartIntegrals::set(double t0, double t1, double tau0, std::span<const DensityPiece> pieces,
                        std::span<const double> extinction) {
  m_length = t1 - t0;
  m_front = transmittance(tau0);
  m_media.resize(pieces.size());
  m_passed.fill(0.0);
  m_tau = 0.0;
  m_has_exponential = false;
  size_t present = 0;
  for (size_t m = 0; m < pieces.size(); ++m) {
    Medium& medium = m_media[m];
    medium = Medium{};
    if (is_absent(pieces[m])) continue;
    ++present;
    medium = present_medium(pieces[m], t0, t1);
    m_has_exponential |= medium.rise != 0.0;
    m_tau += extinction[m] * medium.column;
    for (size_t q = 0; q < kPoints; ++q) {
      m_passed[q] += extinction[m] * column_to(pieces[m], t0 + GaussLegendre8::kX[q] * m_length);
    }
  }
  for (double& passed : m_passed) passed = m_front * transmittance(passed);
  if (m_has_exponential) prepare_ellipses(extinction);
  for (size_t m = 0; m < pieces.size(); ++m) {
    if (is_absent(pieces[m])) continue;
    Medium& medium = m_media[m];
    weigh(pieces[m], medium);
    medium.seen =
        present == 1 ? Enclosed{m_front * medium.column * phi1(m_tau), 0.0} : seen_in_mixture(medium);
  }
}

PartIntegrals::Medium PartIntegrals::present_medium(const DensityPiece& piece, double t0, double t1) {
  Medium medium;
  medium.column = column_to(piece, t1);
  if (piece.rate == 0.0) {
    medium.max_density = *std::max_element(piece.rho.begin(), piece.rho.end());
  } else {
    medium.max_density = std::max(piece.rho[0], density_at(piece, t1));
    medium.middle_density = density_at(piece, 0.5 * (t0 + t1));
    medium.rise = 0.5 * std::abs(piece.rate) * (t1 - t0);
  }
  return medium;
}

/// With the part as [-1, 1], the rule's error is that of the Chebyshev series from degree 16 on, whose
/// coefficients are at most 2 M r^-k, where |integrand| <= M on the ellipse r. Odd degrees cancel; of an even
/// one, the integral is at most 2/255 and the rule at most 2. On the ellipse, where |v| is at most the long
/// axis A, polynomials of degree n that stay below 1 on the part stay below r^n, and exponentials are at most
/// exp(rise A). So a cubic of the depth tau lets at most exp((r^4 - 1) tau/2) through, and an exponential at
/// most exp(A sigma length/2 exp(rise A)), with sigma that of its middle.
void PartIntegrals::prepare_ellipses(std::span<const double> extinction) {
  constexpr double kPerTerm = 2.0 * (2.0 + 2.0 / 255.0);
  for (size_t e = 0; e < kEllipses.size(); ++e) {
    const double r = kEllipses[e], axis = long_axis(r), r2 = r * r;
    double exponent = std::log(0.5 * m_length * m_front * kPerTerm / (1.0 - 1.0 / r2)) - 16.0 * std::log(r);
    for (size_t m = 0; m < m_media.size(); ++m) {
      const Medium& medium = m_media[m];
      const bool is_cubic = medium.rise == 0.0;
      const double grown = is_cubic
                               ? 0.5 * medium.column * (r2 * r2 - 1.0)
                               : 0.5 * m_length * medium.middle_density * axis * std::exp(medium.rise * axis);
      exponent += extinction[m] * grown;
    }
    m_rest[e] = exponent;
  }
}

/// What the rule errs by at most for T rho times a function.
///   factor: of an ellipse's long axis; at least the logarithm of that function's magnitude on it
template <class Factor>
double PartIntegrals::rest_on_ellipses(const Medium& medium, const Factor& factor) const {
  double least = std::numeric_limits<double>::infinity();
  for (size_t e = 0; e < kEllipses.size(); ++e) {
    const double r = kEllipses[e], axis = long_axis(r);
    const double density = medium.rise == 0.0 ? std::log(medium.max_density) + 3.0 * std::log(r)
                                              : std::log(medium.middle_density) + medium.rise * axis;
    least = std::min(least, m_rest[e] + density + factor(axis));
  }
  return std::exp(least);
}

void PartIntegrals::weigh(const DensityPiece& piece, Medium& medium) const {
  for (size_t q = 0; q < kPoints; ++q) {
    const double rho = density_at(piece, piece.t0 + GaussLegendre8::kX[q] * m_length);
    medium.weighted[q] = GaussLegendre8::kWeight[q] * m_length * m_passed[q] * rho;
  }
}

/// T = T_m exp(-x y) with |y| <= 1 and x = tau / 2: its series up to (x y)^3 times rho has degree 15, what is
/// left out is at most x^4/4! exp(x) in the integral and as much in the rule.
Enclosed PartIntegrals::seen_in_mixture(const Medium& medium) const {
  const double x = 0.5 * m_tau;
  const double rest = m_has_exponential ? rest_on_ellipses(medium, [](double) { return 0.0; })
                                        : 2.0 * m_front * medium.column * (x * x * x * x / 24.0);
  const double range = 0.5 * m_front * medium.column * opacity_from_tau(m_tau);
  if (range <= rest) return {m_front * medium.column - range, range};
  double sum = 0.0;
  for (const double value : medium.weighted) sum += value;
  return {sum, rest};
}

/// As above with one degree more: the series ends with (x y)^2.
Enclosed PartIntegrals::seen_slope(size_t m) const {
  const Medium& medium = m_media[m];
  const double x = 0.5 * m_tau;
  const double rest = m_has_exponential
                          ? rest_on_ellipses(medium, [](double axis) { return std::log(0.5 * axis); })
                          : 2.0 * m_front * medium.column * 0.5 * (x * x * x / 6.0);
  const double range = 0.5 * medium.seen.most();
  if (range <= rest) return {0.0, range};
  double sum = 0.0;
  for (size_t q = 0; q < kPoints; ++q) sum += medium.weighted[q] * (GaussLegendre8::kX[q] - 0.5);
  return {sum, rest};
}

/// The mean of the dimming is taken out, its integral is seen(). In what remains the exponent towards the
/// viewer is a quartic, that towards the light linear: products of their series up to degree 15 - 3 are
/// exact.
Enclosed PartIntegrals::seen_dimmed(size_t m, double a, double b) const {
  const Medium& medium = m_media[m];
  const double mean = transmittance(0.5 * (a + b));
  const double least = std::min(a, b), x = 0.5 * m_tau, y = 0.5 * std::abs(b - a);
  const double y2 = y * y, y4 = y2 * y2;
  const double series = y * (x * x * x * (x / 24.0 + 1.0 / 6.0) + x * x * y4 / 240.0 +
                             x * y4 * y4 / 362880.0 + y4 * y4 * y4 / 6227020800.0);
  const double rest =
      m_has_exponential
          ? rest_on_ellipses(
                medium, [&](double axis) { return std::log(std::expm1(y * axis)) - 0.5 * (a + b); })
          : 2.0 * m_front * medium.column * transmittance(least) * series;
  const double brightest = transmittance(least), darkest = transmittance(std::max(a, b));
  const double range = 0.5 * (brightest - darkest) * medium.seen.most();
  const double spread = mean * medium.seen.half;
  if (range <= rest) {
    const double middle = 0.5 * (brightest + darkest);
    return {middle * medium.seen.mid, range + middle * medium.seen.half};
  }
  double sum = mean * medium.seen.mid;
  for (size_t q = 0; q < kPoints; ++q) {
    sum += medium.weighted[q] * (transmittance(a + (b - a) * GaussLegendre8::kX[q]) - mean);
  }
  return {sum, rest + spread};
}

DensityPiece part_of(const DensityPiece& piece, double t0, double t1) {
  if (piece.rate != 0.0) {
    const double rho = density_at(piece, t0);
    return {t0, t1, {rho, rho, rho, rho}, piece.rate};
  }
  const double h = piece.t1 - piece.t0;
  const double u = h > 0.0 ? std::clamp((t0 - piece.t0) / h, 0.0, 1.0) : 0.0;
  const double v = h > 0.0 ? std::clamp((t1 - piece.t0) / h, 0.0, 1.0) : 1.0;
  const auto& b = piece.rho;
  // The polar form: each control value takes some of its three arguments from v, the others from u.
  const auto polar = [&](double r, double s, double t) {
    const double b0 = lerp(b[0], b[1], r), b1 = lerp(b[1], b[2], r), b2 = lerp(b[2], b[3], r);
    return lerp(lerp(b0, b1, s), lerp(b1, b2, s), t);
  };
  return {t0, t1, {polar(u, u, u), polar(u, u, v), polar(u, v, v), polar(v, v, v)}};
}

}  // namespace pileus
