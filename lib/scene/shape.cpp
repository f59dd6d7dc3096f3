#include "lib/scene/shape.h"

#include <cmath>
#include <limits>

#include "lib/core/param_table.h"
#include "lib/math/box.h"

namespace pileus {

void Shape::describe(ParamTable& params) {
  describe_form(params);
  params.plugin<SurfaceShader>("shader", shader, default_shader(), "what light does on the surface");
  params.boolean("hidden", hidden, "not shown itself: only its instances are");
}

bool Shape::may_shadow(const Box3d& box, const Vec3d& towards_sun) const {
  if (box.isEmpty()) return false;
  // The box moves towards the sun: it meets the bounds where its centre meets bounds that are larger by its
  // half size.
  const Box3d solid = bounds();
  const Vec3d center = 0.5 * (box.min + box.max), half = 0.5 * (box.max - box.min);
  if (!std::isfinite(half.length2())) return true;
  const Box3d grown(solid.min - half, solid.max + half);
  return !clip_to_box({center, towards_sun}, {0.0, std::numeric_limits<double>::infinity()}, grown).empty();
}

}  // namespace pileus
