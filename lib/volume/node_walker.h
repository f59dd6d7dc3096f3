#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/math/ray.h"
#include "lib/volume/brick_pyramid.h"

namespace pileus {

/// Walks a ray through the nodes of a pyramid: stretch by stretch, each either inside one node of 16^3 cells
/// or across a larger node in which all values are alike, empty space above all. Crossing parameters come
/// from the integer planes, never from the one before, and each step enters the node behind a plane, so that
/// the walk always moves on (METHODS §9.6).
class NodeWalker {
 public:
  static constexpr int kLevel = 1;
  static constexpr int kCells = 8 << kLevel;  ///< along a node's edge

  struct Stretch {
    double t0, t1;
    ValueRange range;
  };

  /// The ray is in index space relative to pyramid.origin(); d need not have unit length. The segment lies in
  /// the pyramid's table up to rounding.
  NodeWalker(const BrickPyramid& pyramid, const Ray& ray, Segment segment)
      : m_pyramid(pyramid), m_ray(ray), m_t(segment.t0), m_end(segment.t1) {
    for (int axis = 0; axis < 3; ++axis) {
      // A component whose reciprocal overflows moves the ray as little as 0 does.
      m_inverse[axis] = std::isfinite(1.0 / ray.d[axis]) ? 1.0 / ray.d[axis] : 0.0;
      m_forward[axis] = ray.d[axis] > 0.0 ? 1 : 0;
      m_nodes[axis] = pyramid.levels()[kLevel].nodes[axis];
      const double at = std::floor((ray.o[axis] + m_t * ray.d[axis]) / kCells);
      m_node[axis] = int(std::clamp(at, 0.0, double(m_nodes[axis] - 1)));
    }
    for (int axis = 0; axis < 3; ++axis)
      m_exit[axis] = crossing(axis, (m_node[axis] + m_forward[axis]) * kCells);
  }

  /// The next stretch; false at the end of the segment.
  bool next(Stretch& stretch) {
    if (!(m_t < m_end)) return false;
    stretch.t0 = m_t;
    stretch.range = m_pyramid.range(kLevel, m_node * kCells);
    const int level = stretch.range.is_uniform() ? level_of_uniform_node() : kLevel;
    if (level == kLevel) {
      const int axis = exit_axis(m_exit);
      m_t = std::clamp(m_exit[axis], stretch.t0, m_end);
      m_node[axis] += m_forward[axis] ? 1 : -1;
      m_exit[axis] = crossing(axis, (m_node[axis] + m_forward[axis]) * kCells);
      end_outside(axis);
    } else {
      leap(level);
    }
    stretch.t1 = m_t;
    return true;
  }

 private:
  double crossing(int axis, int plane) const {
    return m_inverse[axis] == 0.0 ? std::numeric_limits<double>::infinity()
                                  : (plane - m_ray.o[axis]) * m_inverse[axis];
  }
  static int exit_axis(const double* exit) {
    if (exit[0] <= exit[1]) return exit[0] <= exit[2] ? 0 : 2;
    return exit[1] <= exit[2] ? 1 : 2;
  }

  /// Coarsest level on which the node around the present one is still uniform.
  int level_of_uniform_node() const {
    int level = kLevel;
    while (size_t(level) + 1 < m_pyramid.levels().size() &&
           m_pyramid.range(size_t(level) + 1, m_node * kCells).is_uniform()) {
      ++level;
    }
    return level;
  }

  /// Leaves the node of the given level around the present one.
  void leap(int level) {
    const int shift = level - kLevel;
    double exit[3];
    for (int axis = 0; axis < 3; ++axis) {
      exit[axis] = crossing(axis, (((m_node[axis] >> shift) + m_forward[axis]) << shift) * kCells);
    }
    const int axis = exit_axis(exit);
    m_t = std::clamp(exit[axis], m_t, m_end);
    for (int k = 0; k < 3; ++k) {
      const int lo = m_node[k] >> shift << shift, hi = lo + (1 << shift);
      if (k == axis) {
        m_node[k] = m_forward[k] ? hi : lo - 1;
      } else {
        const double at = std::floor((m_ray.o[k] + m_t * m_ray.d[k]) / kCells);
        m_node[k] = int(std::clamp(at, double(lo), double(std::min(hi, m_nodes[k]) - 1)));
      }
      m_exit[k] = crossing(k, (m_node[k] + m_forward[k]) * kCells);
    }
    end_outside(axis);
  }

  /// Ends the walk behind the outermost nodes.
  void end_outside(int axis) {
    if (m_node[axis] < 0 || m_node[axis] >= m_nodes[axis]) m_end = m_t;
  }

  const BrickPyramid& m_pyramid;
  Ray m_ray;
  double m_t, m_end;
  double m_inverse[3], m_exit[3];
  int m_forward[3], m_nodes[3];
  Vec3i m_node{0, 0, 0};
};

}  // namespace pileus
