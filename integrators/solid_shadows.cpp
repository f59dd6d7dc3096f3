#include "integrators/solid_shadows.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "lib/math/beam.h"
#include "lib/math/box.h"

namespace pileus {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

void append(Segment stretch, std::vector<Segment>& lit) {
  if (!lit.empty() && lit.back().t1 == stretch.t0) {
    lit.back().t1 = stretch.t1;
  } else {
    lit.push_back(stretch);
  }
}

bool are_none(const std::vector<std::vector<const Shape*>>& casters) {
  return std::all_of(casters.begin(), casters.end(), [](const auto& of_light) { return of_light.empty(); });
}

}  // namespace

SolidShadows::SolidShadows(const World& world, double least_depth)
    : m_world(world),
      m_least_depth(least_depth),
      m_casters(world.lights.size()),
      m_holed_casters(world.lights.size()) {
  for (size_t light = 0; light < world.lights.size(); ++light) {
    m_towards_suns.push_back(world.lights[light]->at(Vec3d(0.0)).wi);
    for (const auto& shape : world.shapes) {
      if (!shape->casts_shadow()) continue;
      const bool shades = std::any_of(world.media.begin(), world.media.end(), [&](const WorldMedium& medium) {
        return shape->may_shadow(medium.density->bounds(), m_towards_suns[light]);
      });
      if (shades) (shape->has_holes() ? m_holed_casters : m_casters)[light].push_back(shape.get());
    }
    m_any |= !m_casters[light].empty() || !m_holed_casters[light].empty();
  }
}

bool SolidShadows::is_dappled(std::span<const MarchRay> packet) const {
  return !are_none(m_holed_casters) && !are_none(casters_of(packet, m_holed_casters));
}

uint64_t SolidShadows::find(std::span<MarchRay> packet, std::span<std::vector<Segment>> lit) const {
  const size_t lights = m_casters.size();
  const Casters casters = casters_of(packet, m_casters);
  if (are_none(casters)) return 0;
  std::vector<Segment> inside;
  Segment hull{kInfinity, 0.0};
  for (const MarchRay& job : packet) {
    inside.push_back(inside_media(job.ray, job.segment));
    if (!inside.back().empty())
      hull = {std::min(hull.t0, inside.back().t0), std::max(hull.t1, inside.back().t1)};
  }
  std::vector<std::vector<PacketCaster>> of_packet(lights);
  for (size_t light = 0; light < lights; ++light) {
    for (const Shape* shape : casters[light])
      of_packet[light].push_back(caster_of(*shape, light, packet, hull));
  }
  uint64_t shadow_rays = 0;
  for (size_t i = 0; i < packet.size(); ++i) {
    MarchRay& job = packet[i];
    job.lit = lit.data() + i * lights;
    for (size_t light = 0; light < lights; ++light) {
      std::vector<Segment>& own = lit[i * lights + light];
      own.clear();
      if (!inside[i].empty()) append_lit({job.ray, light, of_packet[light], own, shadow_rays}, inside[i]);
    }
  }
  return shadow_rays;
}

/// Those of all casters that may shade some medium where the rays of a packet pass through it.
SolidShadows::Casters SolidShadows::casters_of(std::span<const MarchRay> packet, const Casters& all) const {
  Beam beam;
  double t0 = kInfinity, t1 = 0.0;
  for (const MarchRay& job : packet) {
    beam.o.extendBy(job.ray.o);
    beam.d.extendBy(job.ray.d);
    t0 = std::min(t0, job.segment.t0), t1 = std::max(t1, job.segment.t1);
  }
  std::vector<Box3d> seen_boxes;
  for (const WorldMedium& medium : m_world.media) {
    const Segment inside = beam.inside(medium.density->bounds());
    const Segment seen{std::max(inside.t0, t0), std::min(inside.t1, t1)};
    if (!seen.empty()) seen_boxes.push_back(beam.box(seen.t0, seen.t1));
  }
  Casters casters(all.size());
  for (size_t light = 0; light < all.size(); ++light) {
    for (const Shape* shape : all[light]) {
      const bool shades = std::any_of(seen_boxes.begin(), seen_boxes.end(), [&](const Box3d& box) {
        return shape->may_shadow(box, m_towards_suns[light]);
      });
      if (shades) casters[light].push_back(shape);
    }
  }
  return casters;
}

/// Where a whole packet is in the sun can be seen at once: the beams of shadow rays that leave it between two
/// t.
SolidShadows::PacketCaster SolidShadows::caster_of(const Shape& shape, size_t light,
                                                   std::span<const MarchRay> packet, Segment media) const {
  PacketCaster caster{&shape, {}};
  if (!shape.knows_clear_distance() || !std::isfinite(media.length())) return caster;
  constexpr int kHalvings = 6;
  std::vector<Ray> beam(2 * packet.size());
  const std::function<void(Segment, int)> look = [&](Segment stretch, int halvings) {
    for (size_t i = 0; i < packet.size(); ++i) {
      beam[2 * i] = {packet[i].ray.at(stretch.t0), m_towards_suns[light]};
      beam[2 * i + 1] = {packet[i].ray.at(stretch.t1), m_towards_suns[light]};
    }
    if (std::isinf(shape.clear_distance(beam))) return append(stretch, caster.clear);
    if (halvings == 0) return;
    const double middle = 0.5 * (stretch.t0 + stretch.t1);
    look({stretch.t0, middle}, halvings - 1);
    look({middle, stretch.t1}, halvings - 1);
  };
  look(media, kHalvings);
  return caster;
}

/// The part of a segment that has all media in it.
Segment SolidShadows::inside_media(const Ray& ray, Segment segment) const {
  Segment hull{kInfinity, 0.0};
  for (const WorldMedium& medium : m_world.media) {
    const Segment inside = clip_to_box(ray, segment, medium.density->bounds());
    if (!inside.empty()) hull = {std::min(hull.t0, inside.t0), std::max(hull.t1, inside.t1)};
  }
  return hull;
}

/// How far apart the sun is looked for where edges are not known: what is shaded for less may be missed. A
/// voxel of the grids that are there, or a stretch of haze that hardly shows.
double SolidShadows::step_at(const Vec3d& p) const {
  double step = kInfinity;
  for (const WorldMedium& medium : m_world.media) {
    const DensityField& density = *medium.density;
    if (!density.bounds().intersects(p)) continue;
    const double voxel = density.feature_size();  // infinite where the density is smooth
    step = std::min(
        step, std::isfinite(voxel) ? voxel : m_least_depth / (medium.extinction * density.max_density()));
  }
  return step;
}

/// Where a ray enters and leaves the media.
void SolidShadows::append_ends(const LitRay& to, Segment segment, std::vector<double>& ends) const {
  for (const WorldMedium& medium : m_world.media) {
    const Segment inside = clip_to_box(to.ray, segment, medium.density->bounds());
    if (!inside.empty()) ends.insert(ends.end(), {inside.t0, inside.t1});
  }
}

/// Between edges the sun is either seen or not.
void SolidShadows::append_lit(const LitRay& to, Segment segment) const {
  std::vector<double> edges;
  bool has_all = true;
  for (const PacketCaster& caster : to.casters)
    has_all &= caster.shape->append_shadow_edges(to.ray, *m_world.lights[to.light], edges);
  if (!has_all) append_ends(to, segment, edges);
  std::erase_if(edges, [&](double t) { return !(t > segment.t0 && t < segment.t1); });
  edges.push_back(segment.t1);
  std::sort(edges.begin(), edges.end());
  double t0 = segment.t0;
  for (const double t1 : edges) {
    if (!has_all) {
      append_lit_between(to, {t0, t1});
    } else if (t1 > t0 && is_lit(to, 0.5 * (t0 + t1))) {
      append({t0, t1}, to.stretches);
    }
    t0 = t1;
  }
}

/// Where edges have to be searched for: what is shaded for less than a step may be missed.
void SolidShadows::append_lit_between(const LitRay& to, Segment segment) const {
  constexpr double kFewest = 4.0, kMost = 512.0;
  constexpr int kHalvings = 12;  // the edge errs by a 4096th of a step
  if (segment.empty()) return;
  const double finest = step_at(to.ray.at(0.5 * (segment.t0 + segment.t1)));
  if (std::isinf(finest)) return append(segment, to.stretches);  // no medium is there
  const int steps = int(std::clamp(segment.length() / finest, kFewest, kMost));
  const double step = segment.length() / steps;
  double t0 = segment.t0, before = t0;  // of the present stretch; the last sample
  bool was_lit = is_lit(to, t0 + 0.5 * step);
  for (int k = 1; k < steps; ++k) {
    const double t = segment.t0 + (k + 0.5) * step;
    if (is_lit(to, t) == was_lit) {
      before = t;
      continue;
    }
    double lo = before, hi = t;
    for (int n = 0; n < kHalvings; ++n) {
      const double middle = 0.5 * (lo + hi);
      (is_lit(to, middle) == was_lit ? lo : hi) = middle;
    }
    if (was_lit) append({t0, hi}, to.stretches);
    t0 = hi, before = t, was_lit = !was_lit;
  }
  if (was_lit) append({t0, segment.t1}, to.stretches);
}

bool SolidShadows::is_lit(const LitRay& to, double t) const {
  const Ray shadow{to.ray.at(t), m_towards_suns[to.light]};
  return std::none_of(to.casters.begin(), to.casters.end(), [&](const PacketCaster& caster) {
    const bool is_clear = std::any_of(caster.clear.begin(), caster.clear.end(), [&](const Segment& stretch) {
      return t >= stretch.t0 && t <= stretch.t1;
    });
    if (is_clear) return false;
    ++to.shadow_rays;
    return caster.shape->intersect(shadow, {0.0, kInfinity}).has_value();
  });
}

}  // namespace pileus
