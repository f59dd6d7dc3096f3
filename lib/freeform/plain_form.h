#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "lib/freeform/form_program.h"
#include "lib/freeform/quadric_on_ray.h"
#include "lib/freeform/stretch_list.h"
#include "lib/math/interval.h"

namespace pileus {

/// What finding crossings took.
struct TraceWork {
  int64_t stretches = 0;  ///< whose bounds were asked for
  int64_t values = 0;     ///< of the function, computed to refine a crossing
};

/// A form at a point, and how far rounding may carry its value there.
struct FormAtPoint {
  double value = 0.0;
  Vec3d gradient{0.0};  ///< [1/m]
  double margin = 0.0;
};

/// factor Q or, of a perturbation, factor max(0, Q)³
struct FormTerm {
  TracedQuadric quadric;
  double factor;
};

/// A form without joins and deformations: sum w_j Q_j + sum f_i max(0, Q_i)³. Morphs of such forms are one,
/// too. Along a ray it is a polynomial in pieces: of degree 2 where no perturbation acts, else of degree 6.
/// ref: METHODS 5.1
class PlainForm {
 public:
  /// The form of a node, where it is a plain one.
  static std::optional<PlainForm> from(const FormProgram& program, int index);

  /// Tells where the form changes its sign on a stretch of a ray, by the Bernstein form of each piece
  /// (METHODS 5.2): a piece whose coefficients change their sign once has one crossing, one whose
  /// coefficients do not has none, others are halved. Coefficients no larger than rounding are taken for 0.
  void trace(const AnchoredRay& ray, const Segment& segment, StretchList& found, TraceWork& work) const;

  /// The documents' binary subdivision: halves whatever bounds cannot decide, down to `precision` [m].
  void subdivide(const AnchoredRay& ray, const Segment& segment, double precision, StretchList& found,
                 TraceWork& work) const;

  /// The form at a point; perturbations that do not act there cost next to nothing.
  FormAtPoint at(const Vec3d& p) const;

  std::span<const FormTerm> base() const { return m_base; }
  std::span<const FormTerm> perturbations() const { return m_perturbations; }

 private:
  bool add(const FormProgram& program, int index, double weight);

  std::vector<FormTerm> m_base, m_perturbations;
};

}  // namespace pileus
