#pragma once

#include <array>
#include <span>
#include <vector>

#include "lib/math/absolute.h"
#include "lib/math/vec.h"
#include "lib/volume/density_field.h"

namespace pileus {

/// A number known to lie within `half` of `mid`; half >= 0.
struct Enclosed {
  double mid = 0.0, half = 0.0;

  double most() const { return mid + half; }
};

/// A colour known like that, channel by channel.
struct EnclosedRgb {
  Rgb mid{0.0, 0.0, 0.0}, half{0.0, 0.0, 0.0};

  EnclosedRgb& operator+=(const EnclosedRgb& other) {
    mid += other.mid;
    half += other.half;
    return *this;
  }
};

/// colour * number, enclosed.
inline EnclosedRgb scaled(const Rgb& colour, const Enclosed& number) {
  return {colour * number.mid, absolute(colour) * number.half};
}

/// The Gauss–Legendre rule of 8 points on [0, 1], exact for polynomials of degree 15.
struct GaussLegendre8 {
  static constexpr std::array<double, 8> kX = {
      0.01985507175123188416, 0.10166676129318663020, 0.23723379504183550709, 0.40828267875217509753,
      0.59171732124782490247, 0.76276620495816449291, 0.89833323870681336980, 0.98014492824876811584};
  static constexpr std::array<double, 8> kWeight = {
      0.05061426814518812958, 0.11119051722668723527, 0.15685332293894364367, 0.18134189168918099148,
      0.18134189168918099148, 0.15685332293894364367, 0.11119051722668723527, 0.05061426814518812958};
};

/// Integrals along a short part of a ray whose densities are cubics or exponentials, with bounds of their
/// errors: closed forms where there are some, else the Gauss rule with a proven remainder
/// (docs/error_bound.md).
class PartIntegrals {
 public:
  /// `pieces` has one per medium: its density on the part, or an empty piece where it is absent.
  ///   tau0: optical depth in front of the part; extinction: of each medium
  void set(double t0, double t1, double tau0, std::span<const DensityPiece> pieces,
           std::span<const double> extinction);

  double tau() const { return m_tau; }                         ///< optical depth of the part
  double length() const { return m_length; }                   ///< [m]
  double front() const { return m_front; }                     ///< transmittance in front of the part
  double column(size_t m) const { return m_media[m].column; }  ///< integral of rho [m]
  double max_density(size_t m) const { return m_media[m].max_density; }

  /// Integral of T rho dt [m].
  const Enclosed& seen(size_t m) const { return m_media[m].seen; }

  /// Integral of T rho (u - 1/2) dt [m], where u runs from 0 to 1 along the part.
  Enclosed seen_slope(size_t m) const;

  /// Integral of T rho exp(-(a + (b - a) u)) dt [m].
  Enclosed seen_dimmed(size_t m, double a, double b) const;

 private:
  static constexpr size_t kPoints = GaussLegendre8::kX.size();

  /// Bernstein ellipses around the part, by the sum of their half axes, where the part is [-1, 1].
  static constexpr std::array<double, 10> kEllipses = {1.25, 1.6, 2.0, 2.6, 3.4, 4.5, 6.0, 9.0, 14.0, 25.0};

  struct Medium {
    double column = 0.0, max_density = 0.0, middle_density = 0.0;
    double rise = 0.0;  ///< of the logarithm of an exponential, from the middle to an end; 0 for cubics
    Enclosed seen;
    std::array<double, kPoints> weighted;  ///< rule's weight * length * T * rho
  };

  static Medium present_medium(const DensityPiece& piece, double t0, double t1);
  void weigh(const DensityPiece& piece, Medium& medium) const;
  Enclosed seen_in_mixture(const Medium& medium) const;
  void prepare_ellipses(std::span<const double> extinction);
  template <class Factor>
  double rest_on_ellipses(const Medium& medium, const Factor& factor) const;

  double m_length = 0.0, m_tau = 0.0, m_front = 1.0;
  std::array<double, kPoints> m_passed{};  ///< T at the points
  std::vector<Medium> m_media;
  bool m_has_exponential = false;

  /// By ellipse: logarithm of what the rule's error on the part is at most, per bound of rho on the ellipse.
  std::array<double, kEllipses.size()> m_rest{};
};

/// A piece on a part [t0, t1] of its own range.
DensityPiece part_of(const DensityPiece& piece, double t0, double t1);

}  // namespace pileus
