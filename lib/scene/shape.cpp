#include "lib/scene/shape.h"

#include <cmath>
#include <limits>

#include "lib/core/param_table.h"
#include "lib/math/box.h"
#include "lib/math/box_shadow.h"
#include "lib/math/offset_point.h"
#include "lib/scene/texture.h"
#include "lib/texture/texture_filter.h"

namespace pileus {

void Shape::describe(ParamTable& params) {
  describe_form(params);
  params.plugin<SurfaceShader>("shader", shader, default_shader(), "what light does on the surface");
  params.boolean("hidden", hidden, "not shown itself: only its instances are");
}

void Shape::append_shadowable(const Ray& ray, Segment segment, const Vec3d& towards_sun,
                              std::vector<Segment>& stretches) const {
  stretches.push_back(shadow_of_box(ray, segment, towards_sun, bounds()));
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

double Shape::light_through(Ray ray, Segment segment, const RaySight& seen, uint64_t& crossings) const {
  constexpr double kLeast = 1e-6;  // of the light, below which nothing counts
  constexpr int kMostCrossings = 1024;
  double passed = 1.0;
  for (int i = 0; i < kMostCrossings; ++i) {
    const auto hit = intersect_seen(ray, segment, seen);
    if (!hit) return passed;
    ++crossings;
    const Vec3d p = ray.at(hit->t);
    const SurfaceArea area = seen_area(hit->n, -ray.d, seen.width_at(hit->t));
    passed *= 1.0 - shader->opacity_at({p, hit->n, area.a, area.b});
    if (!(passed > kLeast)) return 0.0;
    ray.o = offset_point(p, -hit->n, hit->error);
    segment = {0.0, segment.t1 - hit->t};
  }
  return 0.0;
}

}  // namespace pileus
