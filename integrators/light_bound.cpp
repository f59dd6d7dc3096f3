#include "integrators/light_bound.h"

#include <algorithm>
#include <cmath>

#include "lib/math/transmittance.h"

namespace pileus {

void LightBound::reset(size_t terms) {
  m_parts.assign(terms, Part{});
  m_slope = 0.0;
}

void LightBound::cover(std::span<const ScatterTerm> terms, std::span<const Rgb> weights) {
  double slope = 0.0;
  for (size_t i = 0; i < terms.size(); ++i) {
    const Rgb& w = weights[i];
    slope += std::max({std::abs(w.x), std::abs(w.y), std::abs(w.z)}) * terms[i].extinction;
    const double most = std::max({w.x, w.y, w.z});
    if (!(most > 0.0)) continue;
    m_parts[i].most = std::max(m_parts[i].most, most);
    m_parts[i].extinction = std::min(m_parts[i].extinction, terms[i].extinction);
  }
  m_slope = std::max(m_slope, slope);
}

void LightBound::add(const LightBound& light) {
  for (size_t i = 0; i < m_parts.size(); ++i) {
    m_parts[i].most += light.m_parts[i].most;
    m_parts[i].extinction = std::min(m_parts[i].extinction, light.m_parts[i].extinction);
  }
  m_slope += light.m_slope;
}

double LightBound::beyond(double tau) const {
  if (!std::isfinite(tau)) return 0.0;
  double sum = 0.0;
  for (const Part& part : m_parts) {
    if (part.most > 0.0) sum += part.most * transmittance(part.extinction * tau);
  }
  return sum;
}

double LightBound::enough_tau(double tolerance) const {
  double enough = 0.0;
  for (const Part& part : m_parts) {  // each may leave an equal share
    const double too_bright = 100.0 * double(m_parts.size()) * part.most / tolerance;
    if (too_bright > 1.0) enough = std::max(enough, std::log(too_bright) / part.extinction);
  }
  return enough;
}

}  // namespace pileus
