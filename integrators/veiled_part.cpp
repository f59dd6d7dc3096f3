#include "integrators/veiled_part.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/math/transmittance.h"

namespace pileus {

void VeiledPart::set(double t0, double t1, double tau0, std::span<const DensityPiece> pieces,
                     std::span<const double> extinction, const RayFog* fog, const EnclosedRgb& light) {
  constexpr double kGone = 700.0;
  m_clear.set(t0, t1, tau0, pieces, extinction);
  m_has_fog = fog != nullptr;
  if (!fog) return;
  m_depth0 = fog->tau_to(t0), m_depth1 = std::max(m_depth0, fog->tau_to(t1));
  m_front = transmittance(m_depth0), m_back = transmittance(m_depth1);
  m_fog = fog->between(t0, t1);
  if (m_depth1 > kGone) m_fog.bend = std::numeric_limits<double>::infinity();
  m_light = light;
  m_extinction.assign(extinction.begin(), extinction.end());
  m_seen.resize(pieces.size());
  for (size_t m = 0; m < pieces.size(); ++m) m_seen[m] = veiled(m, 0.0, 0.0, m_clear.seen(m));
}

/// What becomes of an integral through the fog: `clear` is without it, dimmed by a at its front and b at its
/// back.
Enclosed VeiledPart::veiled(size_t m, double a, double b, const Enclosed& clear) const {
  const double middle = 0.5 * (m_front + m_back), half = 0.5 * (m_front - m_back);
  const Enclosed by_range{middle * clear.mid, middle * clear.half + half * clear.most()};
  constexpr double kMostBend = 1.0;
  if (!(m_fog.bend < kMostBend)) return by_range;
  Enclosed by_depth = m_clear.seen_dimmed(m, a + m_depth0, b + m_depth1);
  by_depth.half += std::expm1(m_fog.bend) * by_depth.most();
  return by_depth.half < by_range.half ? by_depth : by_range;
}

Enclosed VeiledPart::seen_slope(size_t m) const {
  const Enclosed clear = m_clear.seen_slope(m);
  if (!m_has_fog) return clear;
  const double middle = 0.5 * (m_front + m_back), half = 0.5 * (m_front - m_back);
  return {middle * clear.mid, middle * clear.half + half * 0.5 * m_clear.seen(m).most()};
}

Enclosed VeiledPart::seen_dimmed(size_t m, double a, double b) const {
  const Enclosed clear = m_clear.seen_dimmed(m, a, b);
  return m_has_fog ? veiled(m, a, b, clear) : clear;
}

/// With c the middle of what light grows by per loss of F, the light is within half the range of that times
/// the loss of light0 + c (F0 - F).
EnclosedRgb VeiledPart::fog_light() const {
  if (!m_has_fog) return {};
  const double seen = m_clear.front() * opacity_from_tau(m_clear.tau());
  const Rgb gain = 0.5 * (m_fog.least + m_fog.most);
  EnclosedRgb sum{seen * (m_light.mid + m_front * gain),
                  seen * m_light.half + 0.5 * seen * (m_front - m_back) * (m_fog.most - m_fog.least)};
  for (size_t m = 0; m < m_seen.size(); ++m) sum += scaled(-m_extinction[m] * gain, m_seen[m]);
  return sum;
}

}  // namespace pileus
