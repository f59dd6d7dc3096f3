#pragma once

#include <span>

#include "lib/freeform/form_program.h"
#include "lib/math/interval.h"

namespace pileus {

inline constexpr double kDoubleRoundoff = 0x1p-53;
inline constexpr double kFloatRoundoff = 0x1p-24;

// Bounds of what values become when forms are made of forms. `u` is the unit roundoff of whoever computes the
// values that must lie within.

/// Sums the ranges of a function and of perturbations, and in the end what rounding may add.
class PerturbedRange {
 public:
  explicit PerturbedRange(const Interval& base) : m_sum(base), m_magnitude(base.magnitude()) {}

  /// factor max(0, q)³ for q in a range (METHODS 4.3: for a dent the ends swap).
  void add(const Interval& q, double factor);

  Interval sum(double u) const { return m_sum.widened((m_terms + 8) * u * m_magnitude); }

 private:
  Interval m_sum;
  double m_magnitude;
  int m_terms = 0;
};

/// Both joins rise with their operands (subtraction falls with the second), so the ends tell all.
Interval joined_range(const FormNode& node, const Interval& a, const Interval& b, double u);

/// Linear in beta, hence within the hull of the operands too (METHODS 4.6).
Interval morphed_range(const FormNode& node, const Interval& a, const Interval& b, double u);

/// The betas of a morph between two times.
Interval betas_of(const FormProgram& program, const FormNode& node, double time0, double time1);

/// Algebra of bounds over a box; over a stretch of time as well where `program` says what moves.
struct BoxAlgebra {
  using Value = Interval;
  Box3d box;
  const FormProgram* program = nullptr;
  double time0 = 0.0, time1 = 0.0;

  Interval quadric(const Quadric& quadric) const { return quadric.range(box); }
  Interval perturbed(const Interval& base, std::span<const Perturbation> perturbations) const;
  Interval joined(const FormNode& node, const Interval& a, const Interval& b) const {
    return joined_range(node, a, b, kDoubleRoundoff);
  }
  Interval morphed(const FormNode& node, const Interval& a, const Interval& b) const {
    if (!program) return morphed_range(node, a, b, kDoubleRoundoff);
    const Interval betas = betas_of(*program, node, time0, time1);
    FormNode first = node, last = node;  // linear in beta: the ends tell all
    first.beta = betas.lo;
    last.beta = betas.hi;
    return hull(morphed_range(first, a, b, kDoubleRoundoff), morphed_range(last, a, b, kDoubleRoundoff));
  }
  BoxAlgebra before(const Deformation& deformation) const {
    return {deformation.origins(box, kDoubleRoundoff), program, time0, time1};
  }
  Interval deformed(const Deformation&, const Interval& operand) const { return operand; }
};

/// A box around the solid {form >= 0}, perhaps infinite, perhaps empty; close to the least one where finite.
Box3d solid_bounds(const FormProgram& program);

}  // namespace pileus
