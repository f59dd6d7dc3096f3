#include "integrators/media_shades.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace pileus {
namespace {

constexpr double kRounding = 1e-11;

/// By the bounds of the shape, and by what it knows of beams.
Shade shade_by_bounds(const Shape& shape, const Vec3d& p0, const Vec3d& p1, const Vec3d& wi, double off) {
  const Box3d solid = shape.bounds();
  const double size = length(solid.min) + length(solid.max);
  const double margin = off + kRounding * (length(p0) + length(p1) + (std::isfinite(size) ? size : 0.0));
  Box3d box;
  for (const Vec3d& p : {p0, p1}) {
    box.extendBy(p - Vec3d(margin));
    box.extendBy(p + Vec3d(margin));
  }
  if (!shape.may_shadow(box, wi)) return Shade::none;
  if (!shape.knows_clear_distance()) return Shade::unknown;
  const std::array<Ray, 2> beam{Ray{p0, wi}, Ray{p1, wi}};
  return std::isinf(shape.clear_distance(beam, {})) ? Shade::none : Shade::unknown;
}

Shade shade_of(const Shape& shape, const Vec3d& p0, const Vec3d& p1, const Vec3d& wi, double off) {
  const auto* known = dynamic_cast<const KnownShadow*>(&shape);
  if (!known) return shade_by_bounds(shape, p0, p1, wi, off);
  const Shade shade = known->shade_between(p0, p1, wi, off);
  return shade == Shade::all && shape.has_holes() ? Shade::unknown : shade;
}

}  // namespace

MediaShades::MediaShades(const World& world, const EffectPlan& plan)
    : m_casters(world.lights.size()), m_is_known(world.lights.size(), true) {
  for (size_t light = 0; light < world.lights.size(); ++light) {
    m_towards_suns.push_back(world.lights[light]->at(Vec3d(0.0)).wi);
    if (!plan.surface_shadows) continue;
    for (const auto& shape : world.shapes) {
      const auto may_shade = [&](const WorldMedium& medium) {
        return shape->may_shadow(medium.density->bounds(), m_towards_suns[light]);
      };
      if (!shape->casts_shadow() || std::none_of(world.media.begin(), world.media.end(), may_shade)) continue;
      m_casters[light].push_back(shape.get());
      const bool is_known = dynamic_cast<const KnownShadow*>(shape.get()) && !shape->has_holes();
      if (!is_known) m_is_known[light] = false;
    }
  }
}

Shade MediaShades::between(size_t light, const Vec3d& p0, const Vec3d& p1, double off) const {
  Shade sum = Shade::none;
  for (const Shape* shape : m_casters[light]) {
    const Shade shade = shade_of(*shape, p0, p1, m_towards_suns[light], off);
    if (shade == Shade::all) return Shade::all;
    if (shade == Shade::unknown) sum = Shade::unknown;
  }
  return sum;
}

/// Edges that are known become narrower with every look; of others, little more is told by looking closer.
double MediaShades::finest(size_t light, bool is_in_haze_alone) const {
  if (m_is_known[light]) return is_in_haze_alone ? 0x1p-30 : 0x1p-14;
  return is_in_haze_alone ? 0x1p-10 : 0x1p-2;
}

}  // namespace pileus
