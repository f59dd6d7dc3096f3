#pragma once

#include <functional>
#include <set>
#include <vector>

#include "lib/math/ray.h"
#include "lib/math/vec.h"

namespace pileus::reference {

/// The slow, obvious twin of the integrators: trilinear density by definition, every integral by
/// Gauss–Legendre rules between all the integer planes that the ray crosses. Index space and world space are
/// the same (voxel size 1).
class SingleScattering {
 public:
  using Density = std::function<double(int, int, int)>;  ///< voxel value at integer coordinates

  SingleScattering(Density density, int lo, int hi) : m_density(std::move(density)), m_lo(lo), m_hi(hi) {}

  double rho(const Vec3d& p) const;

  /// Integral of rho from t0 to t1.
  double column(const Ray& ray, double t0, double t1) const;

  /// Radiance scattered towards the ray's origin by a unit sun of direction wi, phase function p, albedo 1.
  double radiance(const Ray& ray, double extinction, const Vec3d& wi, double p, int parts_per_cell) const;

 private:
  std::vector<double> crossings(const Ray& ray) const;

  Density m_density;
  int m_lo, m_hi;  ///< all densities outside [lo, hi]^3 are 0
};

}  // namespace pileus::reference
