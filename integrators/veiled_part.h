#pragma once

#include <span>
#include <vector>

#include "integrators/part_integrals.h"
#include "integrators/ray_fog.h"

namespace pileus {

/// The integrals of PartIntegrals seen through fog: with T times the fog's transmittance F, and with the
/// light that the fog sends from in front of the media. F only falls, and its logarithm is within a proven
/// distance of linear: it is one more exponent, or a factor of known range (docs/error_bound.md).
class VeiledPart {
 public:
  /// As for PartIntegrals.
  ///   fog:   of the ray, with no edge between t0 and t1; null: none
  ///   light: of the fog in front of t0
  void set(double t0, double t1, double tau0, std::span<const DensityPiece> pieces,
           std::span<const double> extinction, const RayFog* fog, const EnclosedRgb& light);

  double length() const { return m_clear.length(); }          ///< [m]
  double front() const { return m_clear.front() * m_front; }  ///< T F in front of the part
  double max_density(size_t m) const { return m_clear.max_density(m); }
  const Rgb& fog_front() const { return m_light.mid; }  ///< light of the fog in front of it

  /// Integral of T F rho dt [m].
  const Enclosed& seen(size_t m) const { return m_has_fog ? m_seen[m] : m_clear.seen(m); }

  /// Integral of T F rho (u - 1/2) dt [m], where u runs from 0 to 1 along the part.
  Enclosed seen_slope(size_t m) const;

  /// Integral of T F rho exp(-(a + (b - a) u)) dt [m].
  Enclosed seen_dimmed(size_t m, double a, double b) const;

  /// Integral of T sigma times the light of the fog in front of it.
  EnclosedRgb fog_light() const;

 private:
  Enclosed veiled(size_t m, double a, double b, const Enclosed& clear) const;

  PartIntegrals m_clear;
  bool m_has_fog = false;
  double m_depth0 = 0.0, m_depth1 = 0.0;  ///< of the fog in front of both ends
  double m_front = 1.0, m_back = 1.0;     ///< F there
  FogRange m_fog;
  EnclosedRgb m_light;
  std::vector<double> m_extinction;
  std::vector<Enclosed> m_seen;
};

}  // namespace pileus
