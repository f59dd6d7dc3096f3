#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "lib/geom/box_index.h"
#include "lib/scene/shape.h"

namespace pileus {

/// A surface point that a ray has met.
struct WorldHit {
  double t;      ///< [m]
  Vec3d n;       ///< unit normal on the ray's side
  double error;  ///< how far rounding may have moved the hit off the surface [m]
  const Shape* shape;
  bool is_inside;  ///< the ray comes from inside the solid
};

/// Which of many shapes a ray meets. Those with bounds are found by an index where they are more than a few;
/// those without are asked one by one. Answers are those of a plain loop: the nearest hit, of the first shape
/// where several are equally near.
class ShapeIndex {
 public:
  ShapeIndex() = default;

  /// The shapes outlive the index.
  explicit ShapeIndex(std::vector<const Shape*> shapes);

  /// Nearest surface with t in (segment.t0, segment.t1).
  ///   seen: how wide pixels are; its `clear` is that of all shapes
  ///   clear: of each shape, as clear_distances() told for rays of which this is one; or empty
  std::optional<WorldHit> nearest(const Ray& ray, Segment segment, const RaySight& seen = {},
                                  std::span<const double> clear = {}) const;

  /// The same of neighbouring rays from t = 0 on, together.
  ///   seen: of each ray; empty: every detail counts
  void nearest(std::span<const Ray> rays, std::span<const RaySight> seen, std::span<const double> clear,
               std::span<std::optional<WorldHit>> hits) const;

  /// Shape::clear_distance of each shape.
  void clear_distances(std::span<const Ray> rays, const RaySight& seen, std::vector<double>& clear) const;

  /// True where a shape that casts shadows, and has no holes, stands in the segment.
  bool is_occluded(const Ray& ray, Segment segment, const RaySight& seen = {}) const;

  /// The same of neighbouring rays, together.
  void find_occluded(std::span<const Ray> rays, std::span<const Segment> segments,
                     std::span<const RaySight> seen, std::span<char> occluded) const;

  /// Share of light that passes the shapes with holes in the segment; counts what it crosses.
  double light_through_holes(const Ray& ray, Segment segment, const RaySight& seen,
                             uint64_t& crossings) const;

 private:
  /// The nearest of the hits so far.
  struct Nearest {
    std::optional<WorldHit> hit;
    size_t number = 0;  ///< of its shape

    Segment segment_for(size_t next, Segment segment) const;
    void take(const std::optional<SurfaceHit>& found, size_t next, const Shape* shape);
  };
  void ask_indexed(const Ray& ray, Segment segment, const RaySight& seen, std::span<const double> clear,
                   Nearest& nearest) const;
  bool is_occluded_by_indexed(const Ray& ray, Segment segment, const RaySight& seen) const;

  std::vector<const Shape*> m_shapes;
  std::vector<size_t> m_alone;    ///< numbers of shapes that are always asked
  std::vector<size_t> m_indexed;  ///< number of the shape of each box
  BoxIndex m_boxes;
  std::vector<const Shape*> m_endless_with_holes, m_with_holes;  ///< without bounds; with
  BoxIndex m_boxes_with_holes;                                   ///< of the latter
};

}  // namespace pileus
