#pragma once

#include <limits>
#include <span>

#include <embree3/rtcore.h>

#include "lib/math/vec.h"

namespace pileus {

/// A bounding volume hierarchy of boxes, in a space of its own where they fill [-1, 1] at most: there every
/// error of single precision has an absolute bound. Boxes are larger by kMargin on every side. What is inside
/// lib/geom asks it by way of BoxIndex or PointIndex.
struct BoxTree {
  static constexpr double kMargin = 0x1p-20;

  Vec3d center{0.0, 0.0, 0.0};
  double scale = 1.0;    ///< a power of 2: p_tree = scale * (p - center)
  double largest = 0.0;  ///< half edge of the box of all boxes
  size_t count = 0;
  RTCScene scene = nullptr;

  /// errors: Error(failed) where memory does not suffice
  ///   boxes: finite; empty ones are left out
  ///   met: called for boxes that rays meet; null: nobody sends any
  BoxTree(std::span<const Box3d> boxes, RTCIntersectFunctionN met);
  BoxTree(const BoxTree&) = delete;
  BoxTree& operator=(const BoxTree&) = delete;
  ~BoxTree();

  Vec3d to_tree(const Vec3d& p) const { return scale * (p - center); }

 private:
  void measure(std::span<const Box3d> boxes);
  static void give_bounds(const RTCBoundsFunctionArguments* args);

  std::span<const Box3d> m_boxes;  ///< while the tree is built
};

}  // namespace pileus
