#pragma once

#include <utility>

#include "lib/freeform/form_program.h"
#include "lib/freeform/free_form.h"
#include "lib/freeform/plain_form.h"
#include "lib/freeform/quadric_on_ray.h"
#include "lib/freeform/stretch_list.h"

namespace pileus {

/// A form of any kind as one function: for smooth joins, for what is perturbed after a join, and for
/// deformations, where nothing is a polynomial.
class JoinedForm {
 public:
  explicit JoinedForm(FormProgram program) : m_form(std::move(program)) {}

  /// Tells where the form changes its sign on a stretch of a ray, by bounds of its value and slope (METHODS
  /// 5.3): a stretch is halved until it is decided or monotone.
  void trace(const AnchoredRay& ray, const Segment& segment, StretchList& found, TraceWork& work) const;

  /// The documents' binary subdivision, down to `precision` [m].
  void subdivide(const AnchoredRay& ray, const Segment& segment, double precision, StretchList& found,
                 TraceWork& work) const;

  FormAtPoint at(const Vec3d& p) const;

 private:
  FreeForm m_form;
};

}  // namespace pileus
