#include "tests/reference/single_scattering.h"

#include <algorithm>
#include <cmath>

namespace pileus::reference {
namespace {

constexpr double kNodes[] = {-0.8611363115940525752, -0.3399810435848562648, 0.3399810435848562648,
                             0.8611363115940525752};
constexpr double kWeights[] = {0.3478548451374538574, 0.6521451548625461426, 0.6521451548625461426,
                               0.3478548451374538574};

/// 4-point Gauss–Legendre: exact for cubics and far beyond.
template <class Function>
double gauss(double a, double b, Function&& f) {
  double sum = 0.0;
  for (int i = 0; i < 4; ++i) sum += kWeights[i] * f(0.5 * (a + b) + 0.5 * (b - a) * kNodes[i]);
  return 0.5 * (b - a) * sum;
}

}  // namespace

double SingleScattering::rho(const Vec3d& p) const {
  const Vec3d base(std::floor(p.x), std::floor(p.y), std::floor(p.z));
  double sum = 0.0;
  for (int n = 0; n < 8; ++n) {
    const Vec3d corner = base + Vec3d(n & 1, (n >> 1) & 1, n >> 2);
    const double weight = (1.0 - std::abs(p.x - corner.x)) * (1.0 - std::abs(p.y - corner.y)) *
                          (1.0 - std::abs(p.z - corner.z));
    sum += weight * m_density(int(corner.x), int(corner.y), int(corner.z));
  }
  return sum;
}

std::vector<double> SingleScattering::crossings(const Ray& ray) const {
  std::set<double> sorted;
  for (int axis = 0; axis < 3; ++axis) {
    if (ray.d[axis] == 0.0) continue;
    for (int plane = m_lo - 1; plane <= m_hi + 1; ++plane) sorted.insert((plane - ray.o[axis]) / ray.d[axis]);
  }
  return {sorted.begin(), sorted.end()};
}

double SingleScattering::column(const Ray& ray, double t0, double t1) const {
  double sum = 0.0, from = t0;
  for (const double crossing : crossings(ray)) {
    const double to = std::clamp(crossing, t0, t1);
    if (to > from) sum += gauss(from, to, [&](double t) { return rho(ray.at(t)); });
    from = std::max(from, to);
  }
  return sum;
}

double SingleScattering::radiance(const Ray& ray, double extinction, const Vec3d& wi, double p,
                                  int parts_per_cell) const {
  const double far = 4.0 * (m_hi - m_lo + 4);
  double sum = 0.0, tau = 0.0, from = 0.0;
  for (const double crossing : crossings(ray)) {
    if (crossing <= from) continue;
    const double h = (crossing - from) / parts_per_cell;
    for (int part = 0; part < parts_per_cell; ++part) {
      const double a = from + part * h;
      sum += gauss(a, a + h, [&](double t) {
        const double tau_here = tau + extinction * gauss(a, t, [&](double s) { return rho(ray.at(s)); });
        const double tau_sun = extinction * column({ray.at(t), wi}, 0.0, far);
        return extinction * rho(ray.at(t)) * p * std::exp(-tau_here - tau_sun);
      });
      tau += extinction * gauss(a, a + h, [&](double s) { return rho(ray.at(s)); });
    }
    from = crossing;
  }
  return sum;
}

}  // namespace pileus::reference
