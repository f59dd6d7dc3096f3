#pragma once

#include <memory>
#include <optional>

#include "lib/freeform/free_form.h"
#include "lib/freeform/plain_form.h"
#include "lib/math/ray.h"
#include "lib/math/segments.h"

namespace pileus {

/// How crossings are found.
enum class TraceMethod {
  newton,      ///< pieces with one crossing at most, then Newton's steps: to rounding
  subdivision  ///< the documents' halving of the ray, to 2^-20 of the solid's size; what it cannot decide is
               ///< taken for inside. For comparison.
};

/// A free form ready to be met by many rays.
/// No crossing whose depth is beyond rounding is missed, and entries and exits alternate; of a ray that only
/// touches the solid a stretch may be told or not (METHODS 5.4, 5.5). docs/freeform.md has what beyond
/// rounding means.
/// ref:     METHODS 5.2 (forms without joins), 5.3 (others), 4.5 (operands of sharp joins on their own)
/// threads: const calls are safe from many threads
class FormTracer {
 public:
  explicit FormTracer(const FreeForm& form, TraceMethod method = TraceMethod::newton);
  ~FormTracer();

  /// The stretches of a segment that lie in the solid. The segment is finite, or else the solid is.
  Segments inside(const Ray& ray, const Segment& segment, TraceWork* work = nullptr) const;

  /// The first t in (segment.t0, segment.t1) at which the ray enters or leaves the solid.
  std::optional<double> first_crossing(const Ray& ray, const Segment& segment,
                                       TraceWork* work = nullptr) const;

  /// The form near its surface: of operands of sharp joins, the one that makes the surface there.
  FormAtPoint at(const Vec3d& p) const;

 private:
  struct Node;
  static std::unique_ptr<Node> make(const FormProgram& program, int index);
  static FormAtPoint at(const Node& node, const Vec3d& p);
  Segments inside(const Node& node, const Ray& ray, const Segment& segment, TraceWork& work) const;
  void trace(const Node& leaf, const Ray& ray, const Segment& segment, const Segment& clipped,
             StretchList& found, TraceWork& work) const;

  TraceMethod m_method;
  std::unique_ptr<Node> m_root;
};

/// The same for one ray.
Segments inside(const FreeForm& form, const Ray& ray, const Segment& segment);

}  // namespace pileus
