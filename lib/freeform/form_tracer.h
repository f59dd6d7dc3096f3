#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "lib/freeform/free_form.h"
#include "lib/freeform/kernels/crossing_kernel.h"
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

  /// first_crossing of neighbouring rays, many at a time: t is infinite where there is none. What the beam of
  /// all of them does not meet, the form or a perturbation, is left out for all. Crossings agree with those
  /// of first_crossing to rounding; the answer to a ray does not depend on the rays beside it.
  void first_crossings(std::span<const Ray> rays, std::span<const Segment> segments,
                       std::span<double> t) const;

  /// Sets `met` of those rays that have a crossing; the others keep theirs, and those whose `met` is set are
  /// not asked.
  void find_met(std::span<const Ray> rays, std::span<const Segment> segments, std::span<char> met) const;

  /// Boxes that hold all of the solid, one for each part that it is the union of: what meets none of them
  /// does not meet the solid.
  std::vector<Box3d> part_bounds() const;

  /// The form near its surface: of operands of sharp joins, the one that makes the surface there.
  FormAtPoint at(const Vec3d& p) const;

 private:
  struct Node;

  /// What rays from outside may enter: the form is the union of all operands, without what is taken away from
  /// each.
  struct Operand {
    const Node* node;
    const PlainForm* plain;                  ///< null: asked ray by ray
    std::vector<Box3d> perturbation_bounds;  ///< outside of each, a perturbation surely does not act
    std::vector<Box3d> taken_bounds;         ///< outside of these, nothing is taken away
  };
  void add_operands(const Node& node, const std::vector<Box3d>& taken_bounds);
  static bool may_be_taken(const Operand& operand, const Ray& ray, Segment segment);
  static bool may_start_inside(const Operand& operand, const Ray& ray, const Segment& segment);
  void cross(std::span<const Ray> rays, std::span<const Segment> segments, Asked asked,
             std::span<double> t) const;
  void cross(const Operand& operand, std::span<const Ray> rays, std::span<const Segment> segments,
             Asked asked, std::span<double> t) const;
  static std::unique_ptr<Node> make(const FormProgram& program, int index);
  static FormAtPoint at(const Node& node, const Vec3d& p);
  Segments inside(const Node& node, const Ray& ray, const Segment& segment, TraceWork& work) const;
  void trace(const Node& leaf, const Ray& ray, const Segment& segment, const Segment& clipped,
             StretchList& found, TraceWork& work) const;

  TraceMethod m_method;
  std::unique_ptr<Node> m_root;
  std::vector<Operand> m_operands;
};

/// The same for one ray.
Segments inside(const FreeForm& form, const Ray& ray, const Segment& segment);

}  // namespace pileus
