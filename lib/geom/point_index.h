#pragma once

#include <memory>
#include <span>
#include <type_traits>

#include "lib/math/vec.h"

namespace pileus {

struct BoxTree;

/// Finds the boxes near a point, in about log n steps; BoxIndex is the same for rays. What is in a box, the
/// visitor measures in double precision; no box is missed that is near enough.
///
/// Immutable once built, safe from many threads. Copies share the tree.
class PointIndex {
 public:
  PointIndex() = default;  ///< of nothing

  /// Box i has the number i. errors: Error(failed) where memory does not suffice
  ///   boxes: finite
  explicit PointIndex(std::span<const Box3d> boxes);

  /// Calls `void visit(size_t box, double& radius)` for the boxes that may be nearer to a point than
  /// `radius`, some of them in vain. `visit` may make it smaller; it throws nothing.
  ///   radius: finite
  template <class Visit>
  void visit(const Vec3d& p, double radius, Visit&& visit) const {
    using Visitor = std::remove_reference_t<Visit>;
    search(p, radius,
           {&visit, [](void* visitor, size_t box, double& r) { (*static_cast<Visitor*>(visitor))(box, r); }});
  }

 private:
  struct Callback {
    void* visitor;
    void (*call)(void* visitor, size_t box, double& radius);
  };

  void search(const Vec3d& p, double radius, Callback callback) const;

  std::shared_ptr<const BoxTree> m_tree;  ///< null where there is no box
};

}  // namespace pileus
