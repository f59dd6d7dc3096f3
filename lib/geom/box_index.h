#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <type_traits>

#include "lib/math/ray.h"
#include "lib/math/vec.h"

namespace pileus {

/// Finds the boxes that a ray may meet, in about log n steps. What is in a box, the visitor tests in double
/// precision; the index only chooses whom to ask. No box is missed that a ray meets within rounding of double
/// precision, however far from the origin: the tree is walked in single precision, with boxes that are larger
/// by more than single precision can err.
///
/// Immutable once built, safe from many threads. Copies share the tree.
class BoxIndex {
 public:
  BoxIndex() = default;  ///< of nothing

  /// Box i has the number i. Empty boxes are met by no ray. errors: Error(failed) where memory does not
  /// suffice
  ///   boxes: finite
  explicit BoxIndex(std::span<const Box3d> boxes);

  /// Calls `bool visit(size_t box, double& t1)` for the boxes that the ray may meet within the segment, near
  /// ones before far ones by and large, some of them in vain. `visit` may bring t1 nearer, and ends the
  /// search by returning false. What it throws reaches the caller.
  ///   ray: d of any length but 0; t counts in lengths of d
  template <class Visit>
  void visit(const Ray& ray, Segment segment, Visit&& visit) const {
    using Visitor = std::remove_reference_t<Visit>;
    search(ray, segment, {&visit, [](void* visitor, size_t box, double& t1) -> bool {
                            return (*static_cast<Visitor*>(visitor))(box, t1);
                          }});
  }

 private:
  struct Callback {
    void* visitor;
    bool (*call)(void* visitor, size_t box, double& t1);
  };
  struct Tree;

  void search(const Ray& ray, Segment segment, Callback callback) const;

  std::shared_ptr<const Tree> m_tree;  ///< null where there is no box
};

}  // namespace pileus
