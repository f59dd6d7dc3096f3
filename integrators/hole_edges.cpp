#include "integrators/hole_edges.h"

#include <algorithm>
#include <cmath>

namespace pileus {
namespace {

/// The light that passes the shape on its way to a ray, and where it jumps.
class HoleEdges {
 public:
  HoleEdges(const Shape& shape, const Ray& ray, const Light& light, double finest, std::vector<double>& edges,
            uint64_t& lookups)
      : m_shape(shape), m_ray(ray), m_light(light), m_finest(finest), m_edges(edges), m_lookups(lookups) {}

  void look(Segment stretch) {
    constexpr int kSteps = 64;
    const auto at = [&](int step) { return stretch.t0 + double(step) / kSteps * stretch.length(); };
    Look before = look_at(at(0));
    for (int step = 1; step <= kSteps; ++step) {
      const Look after = look_at(at(step));
      halve(before, after);
      before = after;
    }
  }

 private:
  struct Look {
    double t, passed;
  };

  Look look_at(double t) {
    const Vec3d p = m_ray.at(t);
    const Illumination here = m_light.at(p);
    return {t, m_shape.light_through({p, here.wi}, {0.0, here.distance}, {}, m_lookups)};
  }

  /// What varies smoothly differs less and less.
  void halve(const Look& before, const Look& after) {
    constexpr double kJump = 0.1;
    if (std::abs(after.passed - before.passed) < kJump) return;
    const double t = 0.5 * (before.t + after.t);
    if (!(after.t - before.t > m_finest) || !(t > before.t && t < after.t)) return m_edges.push_back(t);
    const Look middle = look_at(t);
    halve(before, middle);
    halve(middle, after);
  }

  const Shape& m_shape;
  const Ray& m_ray;
  const Light& m_light;
  double m_finest;
  std::vector<double>& m_edges;
  uint64_t& m_lookups;
};

/// What the shape may shade of a segment; all of it where lights are not suns.
Segment shadowable(const Shape& shape, const Ray& ray, Segment segment, const Light& light) {
  if (!light.is_directional()) return segment;
  std::vector<Segment> stretches;
  shape.append_shadowable(ray, segment, light.at(ray.o).wi, stretches);
  Segment hull{segment.t1, segment.t0};
  for (const Segment& stretch : stretches) {
    if (!stretch.empty()) hull = {std::min(hull.t0, stretch.t0), std::max(hull.t1, stretch.t1)};
  }
  return hull;
}

}  // namespace

size_t append_hole_edges(const Shape& shape, const Ray& ray, Segment segment, const Light& light,
                         double finest, std::vector<double>& edges, uint64_t& lookups) {
  const size_t known = edges.size();
  const Segment stretch = shadowable(shape, ray, segment, light);
  if (!stretch.empty() && std::isfinite(stretch.length()))
    HoleEdges(shape, ray, light, finest, edges, lookups).look(stretch);
  return edges.size() - known;
}

}  // namespace pileus
