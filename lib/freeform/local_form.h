#pragma once

#include <span>
#include <vector>

#include "lib/freeform/form_program.h"
#include "lib/math/interval.h"
#include "lib/math/vec.h"

namespace pileus {

/// Points on a regular lattice, first + step * (i, j, k) with 0 <= i < count.x and so on. Point (i, j, k) has
/// the place (i * count.y + j) * count.z + k in an array: z fastest, as in a leaf of a VDB tree.
struct PointLattice {
  Vec3d first;           ///< [m]
  Vec3d step{1.0};       ///< [m], >= 0
  Vec3i count{8, 8, 8};  ///< >= 1

  size_t size() const { return size_t(count.x) * size_t(count.y) * size_t(count.z); }
  Box3d box() const { return {first, first + step * Vec3d(count - Vec3i(1))}; }
};

/// A quadric about an anchor point, for offsets in single precision.
struct FloatQuadric {
  float constant, x, y, z;       ///< value and first-order terms
  float xx, yy, zz, xy, xz, yz;  ///< second-order terms; cross terms are not doubled
  float factor = 0.0f;           ///< of a perturbation
};

/// A deformation for offsets in single precision: local = rows offset + local_anchor, and offsets of origins
/// are relative to another anchor.
struct FloatDeformation {
  Vec3f rows[3], local_anchor, origin_anchor;
};

/// What of a free form matters in a box: perturbations that do not act there and operands of sharp joins that
/// decide nothing are left out, the rest is laid out for evaluation in single precision, many points at once.
/// threads: const calls are safe from many threads
class LocalForm {
 public:
  LocalForm(const FormProgram& program, const Box3d& box_world);

  /// Bounds of the form in the box that hold for `values` too: with the rounding of single precision.
  const Interval& range() const { return m_range; }

  /// The form in a part of the box: cheaper than from the whole form.
  LocalForm within(const Box3d& part_world) const { return LocalForm(m_program, part_world); }

  /// The centre of the box [m]: what offsets are relative to.
  const Vec3d& anchor() const { return m_anchor; }

  /// f at anchor + (x, y, z)[i], points of the box. The arrays have the same length.
  void values(std::span<const float> x, std::span<const float> y, std::span<const float> z,
              std::span<float> f) const;

  /// f at the points of a lattice within the box.
  void values(const PointLattice& points, std::span<float> f) const;

  /// What is left of the form.
  const FormProgram& program() const { return m_program; }
  std::span<const FloatQuadric> quadrics() const { return m_quadrics; }
  std::span<const FloatQuadric> perturbations() const { return m_perturbations; }
  std::span<const FloatDeformation> deformations() const { return m_deformations; }

 private:
  struct Part {
    int root;
    Interval range;
  };
  struct Mark {
    size_t nodes, quadrics, perturbations, deformations;
  };
  Part add(const FormProgram& program, int index, const Box3d& box, const Vec3d& anchor);
  Mark mark() const;
  void drop_after(const Mark& mark);

  FormProgram m_program;
  std::vector<FloatQuadric> m_quadrics, m_perturbations;  ///< of m_program, in its order
  std::vector<FloatDeformation> m_deformations;
  Vec3d m_anchor;
  Interval m_range;
  bool m_fits_float = true;
};

}  // namespace pileus
