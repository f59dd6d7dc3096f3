#pragma once

#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "lib/freeform/free_form.h"
#include "lib/freeform/local_form.h"
#include "lib/geom/mesh_distance.h"
#include "lib/math/interval.h"
#include "lib/math/vec.h"

namespace pileus {

/// What holds a cloud: a free form, or a closed mesh as if it were one. With d the distance from the mesh,
/// > 0 inside, and D the largest there is, the function of a mesh is
///   f = x (2 - x)   with x = d / D
/// so that the depth that clouds make of it, f / (1 + sqrt(1 - f)), is x: 0 on the surface, 1 deepest inside.
/// The function of a sphere is that of its free form.
/// threads: const, safe from many threads
class CloudBody {
 public:
  CloudBody(const FreeForm& form);  // NOLINT(google-explicit-constructor): a free form is one
  CloudBody(const Quadric& base);   // NOLINT(google-explicit-constructor): and a quadric is a free form
  explicit CloudBody(std::shared_ptr<const MeshDistance> mesh);

  const Box3d& bounds() const;               ///< world space [m]
  double value(const Vec3d& p_world) const;  ///< f [1]

  class Local;
  Local within(const Box3d& box_world) const;

 private:
  FreeForm m_form;
  std::shared_ptr<const MeshDistance> m_mesh;  ///< null: the form
};

/// A body in a box: LocalForm, and the same for meshes. The body must outlive it.
class CloudBody::Local {
 public:
  explicit Local(LocalForm form) : m_form(std::move(form)) {}
  Local(const MeshDistance& mesh, const Box3d& box_world);

  /// Bounds of f in the box that hold for `values` too. Of a mesh: distances differ by no more than their
  /// points do.
  const Interval& range() const { return m_form ? m_form->range() : m_range; }
  Local within(const Box3d& part_world) const;
  const Vec3d& anchor() const { return m_form ? m_form->anchor() : m_anchor; }

  /// f at anchor + (x, y, z)[i], points of the box.
  void values(std::span<const float> x, std::span<const float> y, std::span<const float> z,
              std::span<float> f) const;
  void values(const PointLattice& points, std::span<float> f) const;

 private:
  std::optional<LocalForm> m_form;
  const MeshDistance* m_mesh = nullptr;
  Vec3d m_anchor{0.0, 0.0, 0.0};
  Interval m_range;
};

}  // namespace pileus
