#include "integrators/fog_light.h"

#include <algorithm>
#include <cmath>

namespace pileus {

void FogLight::build(const RayFog* fog, double narrow) {
  m_fog = fog;
  m_narrow = narrow;
  m_places.clear();
  if (!fog || fog->has_closed_form()) return;
  m_places.push_back({0.0, {}});
  for (const double edge : fog->edges()) at(edge);
}

EnclosedRgb FogLight::at(double t) {
  if (m_places.empty()) return {m_fog ? m_fog->to(t).light : Rgb(0.0), Rgb(0.0)};
  const auto after = std::upper_bound(m_places.begin(), m_places.end(), t,
                                      [](double x, const Place& place) { return x < place.t; });
  const EnclosedRgb light = next(*(after - 1), t);
  if (after == m_places.end() && t > m_places.back().t) m_places.push_back({t, light});
  return light;
}

EnclosedRgb FogLight::next(const Place& from, double t) const {
  constexpr int kMostDivisions = 60;
  EnclosedRgb sum = from.light;
  if (t > from.t) add_growth(from.t, t, kMostDivisions, sum);
  return sum;
}

/// Divides what is not narrow; endless stretches where they are twice as far away.
void FogLight::add_growth(double t0, double t1, int divisions, EnclosedRgb& sum) const {
  constexpr int kFewerByHalving = 4;
  const LightGrowth growth = m_fog->growth(t0, t1);
  const EnclosedRgb range{0.5 * (growth.most + growth.least), 0.5 * (growth.most - growth.least)};
  if (std::max({range.half.x, range.half.y, range.half.z}) <= m_narrow || divisions <= 0) {
    sum += range;
    return;
  }
  const bool is_endless = !std::isfinite(t1);
  const double middle = is_endless ? 2.0 * t0 + 1.0 : 0.5 * (t0 + t1);
  add_growth(t0, middle, divisions - kFewerByHalving, sum);
  add_growth(middle, t1, divisions - (is_endless ? 1 : kFewerByHalving), sum);
}

}  // namespace pileus
