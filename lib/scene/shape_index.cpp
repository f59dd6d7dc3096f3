#include "lib/scene/shape_index.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace pileus {
namespace {

/// Up to how many bounded shapes are asked one by one. Measured (bench/README.md, "micro: objects"): the tree
/// begins to pay at 11 spheres, at 7 free forms asked ray by ray, and at 17 that meet packets of rays
/// together.
constexpr size_t kFew = 12;

bool is_finite(const Box3d& box) {
  return std::isfinite(length(box.min)) && std::isfinite(length(box.max));
}

RaySight with_clear(RaySight seen, std::span<const double> clear, size_t number) {
  if (!clear.empty()) seen.clear = clear[number];
  return seen;
}

/// Where it is, no light passes.
bool casts_whole_shadow(const Shape& shape) {
  return shape.casts_shadow() && !shape.has_holes();
}

}  // namespace

ShapeIndex::ShapeIndex(std::vector<const Shape*> shapes) : m_shapes(std::move(shapes)) {
  std::vector<Box3d> boxes, boxes_with_holes;
  for (size_t i = 0; i < m_shapes.size(); ++i) {
    const Box3d box = m_shapes[i]->bounds();
    if (box.isEmpty()) continue;
    if (m_shapes[i]->has_holes()) {
      if (is_finite(box)) boxes_with_holes.push_back(box);
      (is_finite(box) ? m_with_holes : m_endless_with_holes).push_back(m_shapes[i]);
    }
    if (is_finite(box)) boxes.push_back(box);
    (is_finite(box) ? m_indexed : m_alone).push_back(i);
  }
  m_boxes_with_holes = BoxIndex(boxes_with_holes);
  if (m_indexed.size() > kFew) {
    m_boxes = BoxIndex(boxes);
  } else {
    m_alone.insert(m_alone.end(), m_indexed.begin(), m_indexed.end());
    m_indexed.clear();
  }
}

/// Of hits at the same place the first shape's counts, in whatever order they are asked.
Segment ShapeIndex::Nearest::segment_for(size_t next, Segment segment) const {
  if (!hit) return segment;
  const bool wins_ties = next < number;
  return {segment.t0, wins_ties ? std::nextafter(hit->t, std::numeric_limits<double>::infinity()) : hit->t};
}

void ShapeIndex::Nearest::take(const std::optional<SurfaceHit>& found, size_t next, const Shape* shape) {
  if (!found) return;
  hit = WorldHit{found->t, found->n, found->error, shape, found->is_inside};
  number = next;
}

void ShapeIndex::ask_indexed(const Ray& ray, Segment segment, const RaySight& seen,
                             std::span<const double> clear, Nearest& nearest) const {
  if (nearest.hit) segment.t1 = nearest.hit->t;
  m_boxes.visit(ray, segment, [&](size_t box, double& t1) {
    const size_t number = m_indexed[box];
    nearest.take(m_shapes[number]->intersect_seen(ray, nearest.segment_for(number, segment),
                                                  with_clear(seen, clear, number)),
                 number, m_shapes[number]);
    if (nearest.hit) t1 = nearest.hit->t;
    return true;
  });
}

std::optional<WorldHit> ShapeIndex::nearest(const Ray& ray, Segment segment, const RaySight& seen,
                                            std::span<const double> clear) const {
  Nearest nearest;
  for (const size_t number : m_alone) {
    nearest.take(m_shapes[number]->intersect_seen(ray, nearest.segment_for(number, segment),
                                                  with_clear(seen, clear, number)),
                 number, m_shapes[number]);
  }
  ask_indexed(ray, segment, seen, clear, nearest);
  return nearest.hit;
}

void ShapeIndex::nearest(std::span<const Ray> rays, std::span<const RaySight> seen,
                         std::span<const double> clear, std::span<std::optional<WorldHit>> hits) const {
  const Segment whole{0.0, std::numeric_limits<double>::infinity()};
  std::vector<Nearest> nearest(rays.size());
  std::vector<Segment> segments(rays.size(), whole);
  std::vector<RaySight> sights(rays.size());
  const auto sight = [&](size_t i) { return seen.empty() ? RaySight{} : seen[i]; };
  std::vector<std::optional<SurfaceHit>> found(rays.size());
  for (const size_t number : m_alone) {
    if (!clear.empty() && std::isinf(clear[number])) continue;
    for (size_t i = 0; i < rays.size(); ++i) {
      segments[i] = nearest[i].segment_for(number, whole);
      sights[i] = with_clear(sight(i), clear, number);
    }
    m_shapes[number]->intersect_all(rays, segments, sights, found);
    for (size_t i = 0; i < rays.size(); ++i) nearest[i].take(found[i], number, m_shapes[number]);
  }
  for (size_t i = 0; i < rays.size(); ++i) {
    if (!m_indexed.empty()) ask_indexed(rays[i], whole, sight(i), clear, nearest[i]);
    hits[i] = nearest[i].hit;
  }
}

void ShapeIndex::clear_distances(std::span<const Ray> rays, const RaySight& seen,
                                 std::vector<double>& clear) const {
  clear.clear();
  for (const Shape* shape : m_shapes) clear.push_back(shape->clear_distance(rays, seen));
}

bool ShapeIndex::is_occluded(const Ray& ray, Segment segment, const RaySight& seen) const {
  for (const size_t number : m_alone) {
    const Shape& shape = *m_shapes[number];
    if (shape.intersect_seen(ray, segment, seen).has_value() && casts_whole_shadow(shape)) return true;
  }
  return is_occluded_by_indexed(ray, segment, seen);
}

bool ShapeIndex::is_occluded_by_indexed(const Ray& ray, Segment segment, const RaySight& seen) const {
  bool occluded = false;
  m_boxes.visit(ray, segment, [&](size_t box, double&) {
    const Shape& shape = *m_shapes[m_indexed[box]];
    occluded = shape.intersect_seen(ray, segment, seen).has_value() && casts_whole_shadow(shape);
    return !occluded;
  });
  return occluded;
}

void ShapeIndex::find_occluded(std::span<const Ray> rays, std::span<const Segment> segments,
                               std::span<const RaySight> seen, std::span<char> occluded) const {
  std::fill(occluded.begin(), occluded.end(), char(0));
  for (const size_t number : m_alone) {
    if (casts_whole_shadow(*m_shapes[number])) m_shapes[number]->find_met(rays, segments, seen, occluded);
  }
  if (m_indexed.empty()) return;
  for (size_t i = 0; i < rays.size(); ++i) {
    if (!occluded[i]) occluded[i] = is_occluded_by_indexed(rays[i], segments[i], seen[i]);
  }
}

double ShapeIndex::light_through_holes(const Ray& ray, Segment segment, const RaySight& seen,
                                       uint64_t& crossings) const {
  double passed = 1.0;
  for (const Shape* shape : m_endless_with_holes)
    passed *= shape->light_through(ray, segment, seen, crossings);
  if (m_with_holes.empty()) return passed;
  m_boxes_with_holes.visit(ray, segment, [&](size_t box, double&) {
    passed *= m_with_holes[box]->light_through(ray, segment, seen, crossings);
    return passed > 0.0;
  });
  return passed;
}

}  // namespace pileus
