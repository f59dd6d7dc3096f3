#pragma once

#include "lib/cloud/cloud_body.h"
#include "lib/cloud/cloud_recipe.h"
#include "lib/cloud/profile.h"
#include "lib/math/vec.h"

namespace pileus {

/// The free form of a cloud, or the mesh in its place, widened and blown aside level by level. With h the
/// relative height in the form's bounds, c their axis and p a point of the cloud, the form is asked at
///   q = c + (p - c - h shear) / width_profile(h)   across, and at p's own height
/// so that each of its sections is scaled and moved, and none changes its height.
/// threads: const, safe from many threads
class CloudShape {
 public:
  /// The recipe has passed its checks; the form's bounds are finite.
  CloudShape(const CloudRecipe& recipe, const CloudBody& form);

  const CloudBody& form() const { return m_form; }

  /// 0 at the bottom of the form, 1 at its top.
  double relative_height(double y_world) const { return (y_world - m_bottom) / m_height; }
  Interval relative_height(const Box3d& box_world) const {
    return {relative_height(box_world.min.y), relative_height(box_world.max.y)};
  }

  /// False where every p is its own q.
  bool is_changed() const { return m_is_changed; }

  Vec3d form_point(const Vec3d& p_world) const;

  /// A box that holds form_point of all points of a box.
  Box3d form_box(const Box3d& box_world) const;

  /// A box that holds all points whose form_point lies in the bounds of the form [m].
  const Box3d& bounds() const { return m_bounds; }

 private:
  CloudBody m_form;
  Profile m_width;
  Vec3d m_shear, m_axis;
  double m_bottom, m_height;
  bool m_is_changed;
  Box3d m_bounds;
};

}  // namespace pileus
