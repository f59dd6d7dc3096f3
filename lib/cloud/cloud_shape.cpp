#include "lib/cloud/cloud_shape.h"

#include <algorithm>
#include <cmath>

namespace pileus {

namespace {

/// Rounding of form points, in units of the coordinates: five operations on terms no larger.
constexpr double kPointError = 2e-15;

bool is_one(const std::vector<Vec2d>& profile) {
  return std::all_of(profile.begin(), profile.end(), [](const Vec2d& point) { return point.y == 1; });
}

/// {a / b} for b > 0.
Interval quotient(const Interval& a, const Interval& b) {
  return {std::min(a.lo / b.lo, a.lo / b.hi), std::max(a.hi / b.lo, a.hi / b.hi)};
}

}  // namespace

CloudShape::CloudShape(const CloudRecipe& recipe, const CloudBody& form)
    : m_form(form),
      m_width(recipe.width_profile),
      m_shear(recipe.shear),
      m_axis(form.bounds().center()),
      m_bottom(form.bounds().min.y),
      m_height(form.bounds().size().y),
      m_is_changed(!is_one(recipe.width_profile) || recipe.shear != Vec3d(0.0)) {
  const Box3d& box = form.bounds();
  m_bounds = box;
  if (!m_is_changed) return;
  // Sections move and widen linearly between the heights of the profile: the extremes are there.
  std::vector<double> heights{0.0, 1.0};
  for (const Vec2d& point : recipe.width_profile) heights.push_back(point.x);
  for (const int axis : {0, 2}) {
    double lo = box.max[axis], hi = box.min[axis];
    for (const double h : heights) {
      const double width = m_width.value(h), middle = m_axis[axis] + h * m_shear[axis];
      lo = std::min(lo, middle + width * (box.min[axis] - m_axis[axis]));
      hi = std::max(hi, middle + width * (box.max[axis] - m_axis[axis]));
    }
    const double margin = kPointError * (std::fabs(lo) + std::fabs(hi) + std::fabs(m_shear[axis]));
    m_bounds.min[axis] = lo - margin, m_bounds.max[axis] = hi + margin;
  }
}

Vec3d CloudShape::form_point(const Vec3d& p_world) const {
  if (!m_is_changed) return p_world;
  const double h = std::clamp(relative_height(p_world.y), 0.0, 1.0), width = m_width.value(h);
  return {m_axis.x + (p_world.x - m_axis.x - h * m_shear.x) / width, p_world.y,
          m_axis.z + (p_world.z - m_axis.z - h * m_shear.z) / width};
}

Box3d CloudShape::form_box(const Box3d& box_world) const {
  if (!m_is_changed) return box_world;
  Interval h = relative_height(box_world);
  h = {std::clamp(h.lo, 0.0, 1.0), std::clamp(h.hi, 0.0, 1.0)};
  const Interval width = m_width.range(h);
  Box3d box = box_world;
  for (const int axis : {0, 2}) {
    const Interval moved = m_shear[axis] * h;
    const Interval across = quotient(
        {box_world.min[axis] - m_axis[axis] - moved.hi, box_world.max[axis] - m_axis[axis] - moved.lo},
        width);
    const double scale = std::fabs(m_axis[axis]) + std::fabs(box_world.min[axis]) +
                         std::fabs(box_world.max[axis]) + std::fabs(m_shear[axis]);
    const double margin = kPointError * scale * (1 + 1 / width.lo);
    box.min[axis] = m_axis[axis] + across.lo - margin;
    box.max[axis] = m_axis[axis] + across.hi + margin;
  }
  return box;
}

}  // namespace pileus
