#include "lib/texture/color_stops.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "lib/core/param_table.h"

namespace pileus {
namespace {

Rgb between(const ColorStop& a, const ColorStop& b, double x) {
  const double t = (x - a.at) / (b.at - a.at);
  return a.color * (1.0 - t) + b.color * t;
}

}  // namespace

Param& ColorStops::describe(ParamTable& params, const std::string& unit, const std::string& help) {
  const auto describe_next = [this, unit](ParamTable& stop) {
    if (m_is_default) m_stops.clear();
    m_is_default = false;
    // The table is read before the list grows again.
    ColorStop& next = m_stops.emplace_back();
    stop.number("at", next.at, unit, "where the colour is this one").required();
    stop.rgb("color", next.color, "1", "the colour, linear").at_least(0).at_most(1).required();
  };
  return params.group_list("stops", describe_next, help);
}

void ColorStops::check(std::vector<std::string>& problems) const {
  if (m_stops.empty()) problems.emplace_back("stops is empty; expected one stop or more");
  for (size_t i = 1; i < m_stops.size(); ++i) {
    if (m_stops[i - 1].at < m_stops[i].at) continue;
    problems.push_back(fmt::format("stops: {} comes after {}; expected rising values of \"at\"",
                                   m_stops[i].at, m_stops[i - 1].at));
  }
}

Rgb ColorStops::at(double x) const {
  const auto after = std::upper_bound(m_stops.begin(), m_stops.end(), x,
                                      [](double value, const ColorStop& stop) { return value < stop.at; });
  if (after == m_stops.begin()) return m_stops.front().color;
  if (after == m_stops.end()) return m_stops.back().color;
  return between(*(after - 1), *after, x);
}

Rgb ColorStops::integral(double x) const {
  if (x <= m_stops.front().at) return m_stops.front().color * (x - m_stops.front().at);
  Rgb sum(0.0);
  for (size_t i = 1; i < m_stops.size(); ++i) {
    const ColorStop &a = m_stops[i - 1], &b = m_stops[i];
    const double end = std::min(x, b.at);
    sum += 0.5 * (end - a.at) * (a.color + between(a, b, end));
    if (x <= b.at) return sum;
  }
  return sum + m_stops.back().color * (x - m_stops.back().at);
}

Rgb ColorStops::mean(const Interval& x) const {
  // The difference of integrals cancels where the interval is short; there the colour is linear or nearly so.
  const double first = m_stops.front().at;
  const double reach =
      std::max({m_stops.back().at - first, std::fabs(x.lo - first), std::fabs(x.hi - first)});
  if (!(x.width() > 1e-7 * reach)) return at(0.5 * x.lo + 0.5 * x.hi);
  const Rgb mean = (integral(x.hi) - integral(x.lo)) / x.width();
  return {std::clamp(mean.x, 0.0, 1.0), std::clamp(mean.y, 0.0, 1.0), std::clamp(mean.z, 0.0, 1.0)};
}

}  // namespace pileus
