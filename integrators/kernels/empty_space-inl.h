// Where grids have no density.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_EMPTY_SPACE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_EMPTY_SPACE_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_EMPTY_SPACE_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_EMPTY_SPACE_INL_H
#endif

#include <algorithm>
#include <cmath>

#include "hwy/highway.h"

#include "lib/volume/brick_pyramid.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Whether a grid has no density in a box of its local space.
class EmptySpace {
 public:
  explicit EmptySpace(const BrickPyramid& pyramid) : m_pyramid(pyramid) {}

  /// Exact to nodes of about a quarter of the box, and of the given level at
  /// least.
  bool holds(const Box3d& box, size_t level) const {
    const Vec3d size = box.size();
    const double extent = std::max({size.x, size.y, size.z});
    while (level + 1 < m_pyramid.levels().size() && double(8 << level) < 0.25 * extent) ++level;
    const BrickPyramid::Level& nodes = m_pyramid.levels()[level];
    const double edge = double(8 << level);
    Vec3i lo, hi;
    for (int axis = 0; axis < 3; ++axis) {
      const double first = std::max(0.0, std::floor(box.min[axis] / edge)),
                   last = std::min(double(nodes.nodes[axis] - 1), std::floor(box.max[axis] / edge));
      if (!(first <= last)) return true;
      lo[axis] = int(first), hi[axis] = int(last);
    }
    for (int x = lo.x; x <= hi.x; ++x) {
      for (int y = lo.y; y <= hi.y; ++y) {
        const ValueRange* const row =
            nodes.ranges.data() + (size_t(x) * size_t(nodes.nodes.y) + size_t(y)) * size_t(nodes.nodes.z);
        for (int z = lo.z; z <= hi.z; ++z) {
          if (row[z].hi > 0.0f) return false;
        }
      }
    }
    return true;
  }

 private:
  const BrickPyramid& m_pyramid;
};

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
