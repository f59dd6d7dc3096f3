#include "lib/fog/fading.h"

#include <algorithm>
#include <cmath>

#include "lib/fog/fade.h"

namespace pileus {

void Fading::prepare() {
  m_table.clear();
  if (per != Per::table || !(reach() > 0.0 && std::isfinite(reach()))) return;
  m_entries_per_metre = kEntries / reach();
  for (int i = 0; i < kEntries; ++i) m_table.push_back(float(fade(start + double(i) / m_entries_per_metre)));
  m_table.push_back(0.0f);  // all behind is fog
}

/// From `start` to where less than 1e-4 shows.
double Fading::reach() const {
  constexpr double kDeep = 9.21;
  switch (law) {
    case Law::linear:
      return end - start;
    case Law::exponential:
      return kDeep / density;
    case Law::exponential_squared:
      return std::sqrt(kDeep) / density;
  }
  return 0.0;
}

double Fading::distance(double t, const Vec3d& direction, const Vec3d& axis) const {
  if (!is_planar) return t;
  const double per_metre = dot(direction, axis);
  return per_metre > 0.0 ? t * per_metre : 0.0;
}

double Fading::fade(double distance) const {
  const double beyond = std::max(distance - start, 0.0);
  switch (law) {
    case Law::linear:
      return linear_fade(distance, start, end);
    case Law::exponential:
      return exponential_fade(beyond, density);
    case Law::exponential_squared:
      return exponential_squared_fade(beyond, density);
  }
  return 1.0;
}

double Fading::shown(double distance) const {
  if (m_table.empty()) return fade(distance);
  const double x = std::max(distance - start, 0.0) * m_entries_per_metre;
  if (!(x < kEntries)) return 0.0;
  const auto entry = size_t(x);
  const double share = x - double(entry);
  return double(m_table[entry]) + share * (double(m_table[entry + 1]) - double(m_table[entry]));
}

}  // namespace pileus
