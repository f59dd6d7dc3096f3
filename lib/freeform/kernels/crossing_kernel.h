#pragma once

#include <cstddef>
#include <span>

#include "lib/freeform/plain_form.h"

namespace pileus {

/// Stretches of rays to be met with one plain form at once, each counted from a point of its ray that is
/// known to twice double precision (AnchoredRay). Padded to whole vectors.
struct CrossingRays {
  static constexpr size_t kMost = 64;  ///< what is known of them stays in the first cache

  size_t count = 0;
  alignas(64) double point[3][kMost] = {}, rest[3][kMost] = {}, d[3][kMost] = {};
  alignas(64) double rounding[kMost] = {};
  alignas(64) double t0[kMost] = {}, t1[kMost] = {};

  /// The answer: infinite where the ray stays outside, NaN where that is not decided.
  alignas(64) double t[kMost] = {};

  void add(const AnchoredRay& ray, const Segment& local);
};

/// What is asked of rays: where they first enter a form, or only whether they do. The answer to the latter
/// is then any finite number.
enum class Asked { where, whether };

/// Meets rays that start outside a form, or on its surface and leave, with it, a lane of a vector each.
///
/// A lane walks along its ray in steps that are halved where bounds of the function and of its slope decide
/// nothing and doubled behind one that they decided: the function is below 0, it falls, or it rises to a
/// value on this or that side of 0. Newton's steps then find the crossing. All bounds hold for the exact
/// form on the exact ray, so that a step is only passed where no crossing is deeper than rounding; a lane
/// that starts inside, ends near 0 or takes too long is left undecided, for PlainForm::trace.
///
/// What comes out of a lane depends on its ray alone: a perturbation that does not reach it adds exact zeros
/// and may as well not be among those given. Instruction sets differ by rounding.
///
/// Cost model, for a vector of rays: 130 operations per term to set up, 45 per term and step, 15 per term and
/// Newton's step. The pebble of bench/peers has 1 to 3 terms where it is hit, 9 steps and 5 of Newton.
/// ref: METHODS 5.3, 5.4
///
///   perturbations: those that may reach some of the rays
void find_crossings(std::span<const FormTerm> base, std::span<const FormTerm* const> perturbations,
                    Asked asked, CrossingRays& rays);

}  // namespace pileus
