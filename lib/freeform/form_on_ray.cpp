#include "lib/freeform/form_on_ray.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "lib/freeform/form_bounds.h"
#include "lib/freeform/form_program.h"
#include "lib/math/absolute.h"

namespace pileus {

namespace {

constexpr double kRoundings = 48.0;  ///< as in quadric.cpp
constexpr double kTiny = 1e-300;

Interval sum(const Interval& a, const Interval& b) {
  return {a.lo + b.lo, a.hi + b.hi};
}

Interval scaled(double factor, const Interval& a) {
  return factor >= 0 ? Interval{factor * a.lo, factor * a.hi} : Interval{factor * a.hi, factor * a.lo};
}

/// Hull of w a for 0 <= w <= most.
Interval up_to(double most, const Interval& a) {
  return {std::min(0.0, most * a.lo), std::max(0.0, most * a.hi)};
}

/// Algebra of bounds over o + t d, t in an interval about 0; behind a deformation over a box around that.
struct RayAlgebra {
  using Value = RayRange;
  Vec3d o, d;
  Interval t;
  std::optional<Box3d> box{};

  RayRange quadric(const Quadric& quadric) const {
    if (box) return {quadric.range(*box), Interval::everything()};
    const QuadricCoefficients& q = quadric.coefficients();
    const Vec3d offset = o - quadric.frame().center();
    const Vec3d local_o = quadric.frame().local_from_offset(offset);
    const Vec3d local_d = quadric.frame().local_from_offset(d);
    QuadricCoefficients form = q;  // its second-order part
    form.a14 = form.a24 = form.a34 = form.a44 = 0.0;
    const double a = form.value(local_d), b = dot(q.gradient(local_o), local_d), c = q.value(local_o);

    // Rounding: relative to the sums of absolute terms.
    Vec3d reach, speed;
    for (int k = 0; k < 3; ++k) {
      const Vec3d row = absolute(quadric.frame().row(k));
      speed[k] = dot(row, absolute(d));
      reach[k] = dot(row, absolute(offset)) + speed[k] * t.magnitude();
    }
    const double unit = kRoundings * kDoubleRoundoff;
    const double f_margin = unit * q.magnitude(reach) + kTiny;
    const double slope_margin = unit * dot(q.magnitude_gradient(reach), speed) + kTiny;

    const double q0 = c + t.lo * (b + a * t.lo), q2 = c + t.hi * (b + a * t.hi);
    const double q1 = c + 0.5 * b * (t.lo + t.hi) + a * t.lo * t.hi;
    const double s0 = b + 2 * a * t.lo, s1 = b + 2 * a * t.hi;
    return {Interval{std::min({q0, q1, q2}), std::max({q0, q1, q2})}.widened(f_margin),
            Interval{std::min(s0, s1), std::max(s0, s1)}.widened(slope_margin)};
  }

  RayRange perturbed(const RayRange& base, std::span<const Perturbation> perturbations) const {
    PerturbedRange f(base.f);
    Interval slope = base.slope;
    double magnitude = slope.magnitude();
    for (const Perturbation& bump : perturbations) {
      const RayRange q = quadric(bump.quadric);
      f.add(q.f, bump.factor);
      if (!(q.f.hi > 0)) continue;
      const double low = std::max(0.0, q.f.lo), high = q.f.hi;
      const double low2 = 3 * low * low, high2 = 3 * high * high;
      const double falling = q.slope.lo * (q.slope.lo > 0 ? low2 : high2);
      const double rising = q.slope.hi * (q.slope.hi > 0 ? high2 : low2);
      slope = sum(slope, scaled(bump.factor, {falling, rising}));
      magnitude += std::fabs(bump.factor) * high2 * q.slope.magnitude();
    }
    const double terms = 8 + double(perturbations.size());
    return {f.sum(kDoubleRoundoff), slope.widened(terms * kDoubleRoundoff * magnitude)};
  }

  RayRange joined(const FormNode& node, const RayRange& a, const RayRange& b) const {
    const Interval f = joined_range(node, a.f, b.f, kDoubleRoundoff);
    const Interval b_slope = node.join == Join::subtract ? scaled(-1, b.slope) : b.slope;
    if (node.blend.alpha == 1.0) return {f, hull(a.slope, b_slope).widened(kTiny)};  // weights that sum to 1
    const double most = 2 / (1 + node.blend.alpha) * (1 + 8 * kDoubleRoundoff);
    return {f, sum(up_to(most, a.slope), up_to(most, b_slope)).widened(kTiny)};
  }

  RayRange morphed(const FormNode& node, const RayRange& a, const RayRange& b) const {
    return {morphed_range(node, a.f, b.f, kDoubleRoundoff),
            morphed_range(node, a.slope, b.slope, kDoubleRoundoff)};
  }

  RayAlgebra before(const Deformation& deformation) const {
    Box3d around(o + t.lo * d);
    around.extendBy(o + t.hi * d);
    return {o, d, t, deformation.origins(box ? *box : around, kDoubleRoundoff)};
  }
  RayRange deformed(const Deformation&, const RayRange& operand) const {
    return {operand.f, Interval::everything()};
  }
};

}  // namespace

RayRange range_on_line(const FormProgram& program, int index, const Vec3d& o, const Vec3d& d,
                       const Interval& t) {
  return evaluate(program, index, RayAlgebra{o, d, t});
}

RayRange range_on_ray(const FreeForm& form, const Ray& ray, const Segment& segment) {
  // Counted from the middle of the segment: nothing is lost where the ray starts far away.
  const double middle = 0.5 * segment.t0 + 0.5 * segment.t1, half = 0.5 * segment.length();
  return range_on_line(form.program(), form.program().root(), ray.at(middle), ray.d, {-half, half});
}

}  // namespace pileus
