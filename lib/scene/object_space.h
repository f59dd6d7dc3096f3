#pragma once

#include <optional>

#include "lib/math/affine.h"
#include "lib/math/ray.h"
#include "lib/scene/shape.h"

namespace pileus {

/// An object's own space, placed in the world by an affine map: rays go in, hits come out.
class ObjectSpace {
 public:
  ObjectSpace() = default;  ///< the world's

  /// The map must not be singular.
  explicit ObjectSpace(const Affine& world_from_object);

  /// What `intersect(ray, segment)` finds in the object's space, where rays have unit length too, as the
  /// world sees it. The hit's error covers what the way in and out rounds.
  template <class Intersect>
  std::optional<SurfaceHit> intersect(const Ray& ray, Segment segment, const Intersect& in_object) const {
    const LocalRay local = to_object(ray, segment);
    const std::optional<SurfaceHit> hit = in_object(local.ray, local.segment);
    return hit ? to_world(ray, segment, local, *hit) : std::nullopt;
  }

  /// Around all of a box, finite or empty, of the object's space.
  Box3d world_box(const Box3d& box) const;

 private:
  struct LocalRay {
    Ray ray;
    Segment segment;
    double stretch;  ///< t in the object for each t in the world
  };

  LocalRay to_object(const Ray& ray, Segment segment) const;
  std::optional<SurfaceHit> to_world(const Ray& ray, Segment segment, const LocalRay& local,
                                     const SurfaceHit& hit) const;

  Affine m_object_from_world, m_world_from_object;
  double m_growth = 1.0,
         m_shrinkage = 1.0;  ///< bounds on lengths in the world per length in the object; the reverse
  double m_offset = 0.0;     ///< [m] of the world's origin from the object's, in the object
};

}  // namespace pileus
