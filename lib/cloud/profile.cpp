#include "lib/cloud/profile.h"

#include <algorithm>

namespace pileus {

double Profile::value(double x) const {
  const auto after = std::upper_bound(m_points.begin(), m_points.end(), x,
                                      [](double value, const Vec2d& point) { return value < point.x; });
  if (after == m_points.begin()) return m_points.front().y;
  if (after == m_points.end()) return m_points.back().y;
  const Vec2d &a = *(after - 1), &b = *after;
  return a.y + (b.y - a.y) * ((x - a.x) / (b.x - a.x));
}

Interval Profile::range(const Interval& x) const {
  const double first = value(x.lo), last = value(x.hi);
  Interval range{std::min(first, last), std::max(first, last)};
  for (const Vec2d& point : m_points) {
    if (x.lo <= point.x && point.x <= x.hi) range = hull(range, {point.y, point.y});
  }
  return range;
}

}  // namespace pileus
