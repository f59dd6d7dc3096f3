#include "integrators/solid_shadows.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "lib/math/beam.h"
#include "lib/math/box.h"
#include "lib/scene/point_source.h"

namespace pileus {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Parts of what a solid may shade, halved so often, are looked at on their own.
constexpr int kHalvings = 6;

constexpr double kNegligible = 1.0 / 600.0;  ///< of what may be missed

/// Sorts and merges.
Segments united(std::vector<Segment>& stretches) {
  std::sort(stretches.begin(), stretches.end(),
            [](const Segment& a, const Segment& b) { return a.t0 < b.t0; });
  Segments result;
  for (const Segment& stretch : stretches) append(result, stretch);
  return result;
}

bool are_none(const std::vector<std::vector<const Shape*>>& casters) {
  return std::all_of(casters.begin(), casters.end(), [](const auto& of_light) { return of_light.empty(); });
}

}  // namespace

SolidShadows::SolidShadows(const World& world, double least_depth)
    : m_world(world),
      m_detail{least_depth, kNegligible * least_depth},
      m_casters(world.lights.size()),
      m_holed_casters(world.lights.size()) {
  for (size_t light = 0; light < world.lights.size(); ++light) {
    m_towards_suns.push_back(world.lights[light]->at(Vec3d(0.0)).wi);
    for (const auto& shape : world.shapes) {
      if (!shape->casts_shadow()) continue;
      const bool shades = std::any_of(world.media.begin(), world.media.end(), [&](const WorldMedium& medium) {
        return may_shade(*shape, medium.density->bounds(), light);
      });
      if (shades) (shape->has_holes() ? m_holed_casters : m_casters)[light].push_back(shape.get());
    }
    m_any |= !m_casters[light].empty() || !m_holed_casters[light].empty();
  }
}

/// False where a shape surely stands between no point of a box and a light.
bool SolidShadows::may_shade(const Shape& shape, const Box3d& box, size_t light) const {
  const auto* lamp = dynamic_cast<const PointSource*>(m_world.lights[light].get());
  if (!lamp) return shape.may_shadow(box, m_towards_suns[light]);
  Box3d ways = box;
  ways.extendBy(lamp->position);
  return ways.intersects(shape.bounds());
}

void SolidShadows::mark_dappled(std::span<const MarchRay> jobs, std::span<char> dappled) const {
  if (are_none(m_holed_casters)) return;
  const Casters casters = casters_of(jobs, m_holed_casters);
  std::vector<Segment> stretches;
  for (size_t i = 0; i < jobs.size(); ++i) {
    const Segment inside = inside_media(jobs[i].ray, jobs[i].segment);
    stretches.clear();
    for (size_t light = 0; light < casters.size() && !inside.empty(); ++light) {
      for (const Shape* shape : casters[light])
        shape->append_shadowable(jobs[i].ray, inside, m_towards_suns[light], stretches);
    }
    dappled[i] = std::any_of(stretches.begin(), stretches.end(),
                             [](const Segment& stretch) { return !stretch.empty(); });
  }
}

uint64_t SolidShadows::find(std::span<MarchRay> jobs, std::span<std::vector<Segment>> lit) const {
  const size_t lights = m_casters.size();
  const Casters casters = casters_of(jobs, m_casters);
  if (are_none(casters)) return 0;
  const Packet packet = packet_of(jobs);
  std::vector<Segments> shadows(jobs.size()), of_one(jobs.size());
  uint64_t shadow_rays = 0;
  bool is_any_shaded = false;
  for (size_t light = 0; light < lights; ++light) {
    std::vector<double> left_out(jobs.size(), 0.0);
    for (const Shape* shape : casters[light]) {
      shadow_rays += shape->knows_shadow_edges() ? find_by_edges(*shape, light, packet, of_one)
                                                 : search(*shape, light, packet, left_out, of_one);
      for (size_t i = 0; i < jobs.size(); ++i) {
        if (!of_one[i].empty()) shadows[i] = unite(shadows[i], std::exchange(of_one[i], {}));
      }
    }
    for (size_t i = 0; i < jobs.size(); ++i) {
      const Segments inside = packet.inside[i].empty() ? Segments{} : Segments{packet.inside[i]};
      lit[i * lights + light] = subtract(inside, shadows[i]);
      is_any_shaded |= !shadows[i].empty();
      shadows[i].clear();
    }
  }
  for (size_t i = 0; is_any_shaded && i < jobs.size(); ++i) jobs[i].lit = lit.data() + i * lights;
  return shadow_rays;
}

SolidShadows::Packet SolidShadows::packet_of(std::span<const MarchRay> jobs) const {
  Packet packet;
  for (const MarchRay& job : jobs) {
    packet.rays.push_back(job.ray);
    packet.inside.push_back(inside_media(job.ray, job.segment));
  }
  return packet;
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
      const bool shades = std::any_of(seen_boxes.begin(), seen_boxes.end(),
                                      [&](const Box3d& box) { return may_shade(*shape, box, light); });
      if (shades) casters[light].push_back(shape);
    }
  }
  return casters;
}

/// Between edges the light is either seen or not.
uint64_t SolidShadows::find_by_edges(const Shape& shape, size_t light, const Packet& packet,
                                     std::span<Segments> shadows) const {
  std::vector<std::pair<size_t, Segment>> stretches;  // of which rays
  std::vector<Vec3d> middles;
  for (size_t i = 0; i < packet.rays.size(); ++i) {
    const Segment inside = packet.inside[i];
    if (inside.empty()) continue;
    std::vector<double> edges;
    shape.append_shadow_edges(packet.rays[i], *m_world.lights[light], edges);
    std::erase_if(edges, [&](double t) { return !(t > inside.t0 && t < inside.t1); });
    edges.push_back(inside.t1);
    std::sort(edges.begin(), edges.end());
    double t0 = inside.t0;
    for (const double t1 : edges) {
      if (!(t1 > t0)) continue;
      stretches.push_back({i, {t0, t1}});
      middles.push_back(packet.rays[i].at(0.5 * (t0 + t1)));
      t0 = t1;
    }
  }
  const std::vector<char> is_shaded = are_shaded(shape, *m_world.lights[light], middles);
  for (size_t n = 0; n < stretches.size(); ++n) {
    if (is_shaded[n]) append(shadows[stretches[n].first], stretches[n].second);
  }
  return middles.size();
}

/// Looked for in what the shape may shade of each ray.
uint64_t SolidShadows::search(const Shape& shape, size_t light, const Packet& packet,
                              std::span<double> left_out, std::span<Segments> shadows) const {
  std::vector<SearchedRay> searched;
  Segment reach{kInfinity, 0.0};  // of the shadow on all rays
  std::vector<Segment> stretches;
  for (size_t i = 0; i < packet.rays.size(); ++i) {
    stretches.clear();
    if (!packet.inside[i].empty())
      shape.append_shadowable(packet.rays[i], packet.inside[i], m_towards_suns[light], stretches);
    searched.push_back({packet.rays[i], packet.inside[i], united(stretches), 0.0, &left_out[i]});
    const Segments& may_be_shaded = searched.back().may_be_shaded;
    if (may_be_shaded.empty()) continue;
    reach = {std::min(reach.t0, may_be_shaded.front().t0), std::max(reach.t1, may_be_shaded.back().t1)};
  }
  if (reach.empty()) return 0;
  const Segments clear = clear_stretches(shape, light, packet, reach);
  for (SearchedRay& ray : searched) {
    ray.longest_step = std::ldexp(reach.length(), -kHalvings);
    if (!clear.empty()) ray.may_be_shaded = subtract(ray.may_be_shaded, clear);
  }
  return search_shadows(m_world, m_detail, shape, m_towards_suns[light], searched, shadows);
}

/// Where a shape surely shades none of the rays can be seen at once: the beams of shadow rays that leave the
/// packet between two t.
Segments SolidShadows::clear_stretches(const Shape& shape, size_t light, const Packet& packet,
                                       Segment reach) const {
  Segments clear;
  if (!shape.knows_clear_distance() || !std::isfinite(reach.length())) return clear;
  std::vector<Ray> beam;
  const std::function<void(Segment, int)> look = [&](Segment stretch, int halvings) {
    beam.clear();
    for (size_t i = 0; i < packet.rays.size(); ++i) {
      const Segment& inside = packet.inside[i];
      const double t0 = std::max(stretch.t0, inside.t0), t1 = std::min(stretch.t1, inside.t1);
      if (!(t0 < t1)) continue;
      for (const double t : {t0, t1}) beam.push_back({packet.rays[i].at(t), m_towards_suns[light]});
    }
    if (beam.empty() || std::isinf(shape.clear_distance(beam, {}))) return append(clear, stretch);
    if (halvings == 0) return;
    const double middle = 0.5 * (stretch.t0 + stretch.t1);
    look({stretch.t0, middle}, halvings - 1);
    look({middle, stretch.t1}, halvings - 1);
  };
  look(reach, kHalvings);
  return clear;
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

}  // namespace pileus
