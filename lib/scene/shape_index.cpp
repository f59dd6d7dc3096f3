#include "lib/scene/shape_index.h"

#include <cmath>
#include <limits>
#include <utility>

namespace pileus {
namespace {

bool is_finite(const Box3d& box) {
  return std::isfinite(length(box.min)) && std::isfinite(length(box.max));
}

}  // namespace

ShapeIndex::ShapeIndex(std::vector<const Shape*> shapes) : m_shapes(std::move(shapes)) {
  std::vector<Box3d> boxes;
  for (size_t i = 0; i < m_shapes.size(); ++i) {
    const Box3d box = m_shapes[i]->bounds();
    if (box.isEmpty()) continue;
    if (is_finite(box)) boxes.push_back(box);
    (is_finite(box) ? m_indexed : m_alone).push_back(i);
  }
  if (m_indexed.size() > kFew) {
    m_boxes = BoxIndex(boxes);
  } else {
    m_alone.insert(m_alone.end(), m_indexed.begin(), m_indexed.end());
    m_indexed.clear();
  }
}

std::optional<WorldHit> ShapeIndex::nearest(const Ray& ray, Segment segment, const RaySight& seen,
                                            std::span<const double> clear) const {
  std::optional<WorldHit> best;
  size_t best_number = 0;
  const auto ask = [&](size_t number) {
    // Of hits at the same place the first shape's counts, in whatever order they are asked.
    const bool wins_ties = best && number < best_number;
    const double t1 =
        wins_ties ? std::nextafter(best->t, std::numeric_limits<double>::infinity()) : segment.t1;
    const Shape* shape = m_shapes[number];
    RaySight here = seen;
    if (!clear.empty()) here.clear = clear[number];
    if (const auto hit = shape->intersect_seen(ray, {segment.t0, t1}, here)) {
      best = WorldHit{hit->t, hit->n, hit->error, shape, hit->is_inside};
      best_number = number;
      segment.t1 = hit->t;
    }
  };
  for (const size_t number : m_alone) ask(number);
  m_boxes.visit(ray, segment, [&](size_t box, double& t1) {
    ask(m_indexed[box]);
    t1 = segment.t1;
    return true;
  });
  return best;
}

void ShapeIndex::clear_distances(std::span<const Ray> rays, std::vector<double>& clear) const {
  clear.clear();
  for (const Shape* shape : m_shapes) clear.push_back(shape->clear_distance(rays));
}

bool ShapeIndex::is_occluded(const Ray& ray, Segment segment, const RaySight& seen) const {
  const auto stands_in = [&](size_t number) {
    return m_shapes[number]->intersect_seen(ray, segment, seen).has_value() &&
           m_shapes[number]->casts_shadow();
  };
  for (const size_t number : m_alone) {
    if (stands_in(number)) return true;
  }
  bool occluded = false;
  m_boxes.visit(ray, segment, [&](size_t box, double&) {
    occluded = stands_in(m_indexed[box]);
    return !occluded;
  });
  return occluded;
}

}  // namespace pileus
