#include "lib/freeform/kernels/crossing_kernel.h"

#include <array>
#include <limits>

#include "lib/freeform/form_bounds.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/freeform/kernels/crossing_kernel.cpp"
#include "hwy/foreach_target.h"  // compiles this file again for each target
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::ScalableTag<double>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;

constexpr size_t kMostTerms = 32;    ///< that act on one vector of rays; more are left to the scalar way
constexpr int kMostStretches = 192;  ///< that a vector of rays takes
constexpr int kMostNewton = 60;
constexpr double kShortest = 0x1p-30;  ///< step, as a share of the whole
constexpr double kEnd = std::numeric_limits<double>::infinity();
constexpr double kUndecided = std::numeric_limits<double>::quiet_NaN();

HWY_INLINE V set(double x) {
  return hn::Set(D(), x);
}

struct V3 {
  V x, y, z;
};

HWY_INLINE V3 load(const double (&from)[3][CrossingRays::kMost], size_t i) {
  const D d;
  return {hn::Load(d, from[0] + i), hn::Load(d, from[1] + i), hn::Load(d, from[2] + i)};
}

HWY_INLINE V dot(const V3& a, const V3& b) {
  return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}

HWY_INLINE V dot(const Vec3d& a, const V3& b) {
  return hn::MulAdd(set(a.x), b.x, hn::MulAdd(set(a.y), b.y, hn::Mul(set(a.z), b.z)));
}

HWY_INLINE V3 absolute(const V3& a) {
  return {hn::Abs(a.x), hn::Abs(a.y), hn::Abs(a.z)};
}

HWY_INLINE V second_order(const QuadricCoefficients& q, const V3& p) {
  V sum = hn::Mul(hn::Mul(set(q.a11), p.x), p.x);
  sum = hn::MulAdd(hn::Mul(set(q.a22), p.y), p.y, sum);
  sum = hn::MulAdd(hn::Mul(set(q.a33), p.z), p.z, sum);
  if (!q.has_cross_terms()) return sum;
  sum = hn::MulAdd(hn::Mul(set(q.a12), p.x), p.y, sum);
  sum = hn::MulAdd(hn::Mul(set(q.a13), p.x), p.z, sum);
  return hn::MulAdd(hn::Mul(set(q.a23), p.y), p.z, sum);
}

HWY_INLINE V value_at(const QuadricCoefficients& q, const V3& p) {
  return hn::Add(second_order(q, p), hn::Add(dot(Vec3d(q.a14, q.a24, q.a34), p), set(q.a44)));
}

/// Without the terms of first order.
HWY_INLINE V3 second_order_gradient(const QuadricCoefficients& q, const V3& p) {
  V3 g{hn::Mul(set(2 * q.a11), p.x), hn::Mul(set(2 * q.a22), p.y), hn::Mul(set(2 * q.a33), p.z)};
  if (!q.has_cross_terms()) return g;
  g.x = hn::MulAdd(set(q.a12), p.y, hn::MulAdd(set(q.a13), p.z, g.x));
  g.y = hn::MulAdd(set(q.a12), p.x, hn::MulAdd(set(q.a23), p.z, g.y));
  g.z = hn::MulAdd(set(q.a13), p.x, hn::MulAdd(set(q.a23), p.y, g.z));
  return g;
}

HWY_INLINE V3 gradient_at(const QuadricCoefficients& q, const V3& p) {
  const V3 g = second_order_gradient(q, p);
  return {hn::Add(g.x, set(q.a14)), hn::Add(g.y, set(q.a24)), hn::Add(g.z, set(q.a34))};
}

/// A quadric along each ray (QuadraticOnRay), and how far rounding may carry its values and Bernstein
/// coefficients, and its slopes, anywhere on the stretch.
struct LaneQuadratic {
  V at, a, b, c;
  V margin, slope_margin;
  double factor;

  HWY_INLINE V value(V t) const {
    const V u = hn::Sub(t, at);
    return hn::MulAdd(u, hn::MulAdd(a, u, b), c);
  }
};

/// Bounds over one step of each ray.
struct LaneBounds {
  V low, high, slope_low, slope_high;
};

/// The form at one point of each ray.
struct LaneValue {
  V f, slope, margin;
};

class CrossingKernel {
 public:
  CrossingKernel(std::span<const FormTerm> base, std::span<const FormTerm* const> perturbations, Asked asked,
                 CrossingRays& rays)
      : m_base(base), m_perturbations(perturbations), m_asked(asked), m_rays(rays) {}

  void run() {
    for (size_t i = 0; i < m_rays.count; i += hn::Lanes(D())) hn::Store(cross(i), D(), m_rays.t + i);
  }

 private:
  HWY_INLINE V cross(size_t i) {
    const D d;
    m_point = load(m_rays.point, i);
    m_rest = load(m_rays.rest, i);
    m_d = load(m_rays.d, i);
    m_rounding = hn::Load(d, m_rays.rounding + i);
    m_t0 = hn::Load(d, m_rays.t0 + i);
    m_t1 = hn::Load(d, m_rays.t1 + i);
    if (!set_up()) return set(kUndecided);
    return walk();
  }

  /// False where there are too many terms.
  HWY_INLINE bool set_up() {
    const D d;
    if (m_base.size() > kMostTerms) return false;
    m_count = 0;
    for (const FormTerm& term : m_base) m_terms[m_count++] = along(term);
    m_base_count = m_count;
    for (const FormTerm* term : m_perturbations) {
      const M meets_ball = may_be_positive(term->quadric);
      if (hn::AllFalse(d, meets_ball)) continue;
      LaneQuadratic q = along(*term);
      const M acts = hn::And(meets_ball, may_be_positive(q));
      if (hn::AllFalse(d, acts)) continue;
      if (m_count == kMostTerms) return false;
      // Elsewhere it is -1 all over: its cube adds exact zeros.
      q.a = hn::IfThenElseZero(acts, q.a);
      q.b = hn::IfThenElseZero(acts, q.b);
      q.c = hn::IfThenElse(acts, q.c, set(-1.0));
      q.margin = hn::IfThenElseZero(acts, q.margin);
      q.slope_margin = hn::IfThenElseZero(acts, q.slope_margin);
      m_terms[m_count++] = q;
    }
    return true;
  }

  /// TracedQuadric::may_be_positive
  HWY_INLINE M may_be_positive(const TracedQuadric& quadric) const {
    const Vec3d& center = quadric.ball_center();
    const V3 w{hn::Sub(m_point.x, set(center.x)), hn::Sub(m_point.y, set(center.y)),
               hn::Sub(m_point.z, set(center.z))};
    const V on = dot(w, m_d);
    const V3 across{hn::NegMulAdd(on, m_d.x, w.x), hn::NegMulAdd(on, m_d.y, w.y),
                    hn::NegMulAdd(on, m_d.z, w.z)};
    return hn::Not(
        hn::Gt(dot(across, across), hn::MulAdd(set(1e-14), dot(w, w), set(quadric.ball_square()))));
  }

  /// False where the quadratic is surely negative on the stretch.
  HWY_INLINE M may_be_positive(const LaneQuadratic& q) const {
    const V u0 = hn::Sub(m_t0, q.at), u1 = hn::Sub(m_t1, q.at), limit = hn::Mul(set(-2.0), q.margin);
    const V q1 = hn::MulAdd(hn::Mul(q.a, u0), u1, hn::MulAdd(hn::Mul(set(0.5), q.b), hn::Add(u0, u1), q.c));
    const V most = hn::Max(q1, hn::Max(q.value(m_t0), q.value(m_t1)));
    const V peak = hn::Sub(q.c, hn::Div(hn::Mul(q.b, q.b), hn::Mul(set(4.0), q.a)));
    const M falls_off = hn::And(hn::Lt(q.a, set(0.0)), hn::Lt(peak, limit));
    return hn::Not(hn::Or(falls_off, hn::Lt(most, limit)));
  }

  /// TracedQuadric::along
  HWY_INLINE LaneQuadratic along(const FormTerm& term) const {
    const TracedQuadric& quadric = term.quadric;
    const QuadricCoefficients &coefficients = quadric.coefficients(), &magnitudes = quadric.magnitudes();
    const Vec3d &center = quadric.center(), &lengths = quadric.row_lengths();
    const V3 w{hn::Add(hn::Sub(m_point.x, set(center.x)), m_rest.x),
               hn::Add(hn::Sub(m_point.y, set(center.y)), m_rest.y),
               hn::Add(hn::Sub(m_point.z, set(center.z)), m_rest.z)};
    const V3 x{dot(quadric.row(0), w), dot(quadric.row(1), w), dot(quadric.row(2), w)};
    const V3 along{dot(quadric.row(0), m_d), dot(quadric.row(1), m_d), dot(quadric.row(2), m_d)};
    LaneQuadratic q;
    q.factor = term.factor;
    q.a = second_order(coefficients, along);
    const V nearest = hn::Neg(hn::Div(dot(x, along), dot(along, along)));
    q.at = hn::Min(hn::Max(nearest, m_t0), m_t1);
    const V3 p{hn::MulAdd(q.at, along.x, x.x), hn::MulAdd(q.at, along.y, x.y),
               hn::MulAdd(q.at, along.z, x.z)};
    q.b = dot(gradient_at(coefficients, p), along);
    q.c = value_at(coefficients, p);

    const V unit = set(TracedQuadric::kRoundings * kDoubleRoundoff);
    const V3 size = absolute(p), speed = absolute(along);
    const V moved = hn::MulAdd(unit, hn::Add(hn::Sqrt(dot(w, w)), hn::Abs(q.at)), m_rounding);
    const V3 slope = gradient_at(magnitudes, size);
    const V rise = dot(lengths, slope), bend = dot(lengths, second_order_gradient(magnitudes, speed));
    const V margin0 = hn::MulAdd(unit, value_at(magnitudes, size), hn::Mul(moved, rise));
    const V margin1 = hn::MulAdd(unit, hn::Add(dot(slope, speed), rise), hn::Mul(moved, bend));
    const V margin2 = hn::Mul(unit, hn::Add(second_order(magnitudes, speed), bend));
    const V far = hn::Max(hn::Abs(hn::Sub(m_t0, q.at)), hn::Abs(hn::Sub(m_t1, q.at)));
    q.margin = hn::MulAdd(far, hn::MulAdd(far, margin2, margin1), margin0);
    q.slope_margin = hn::MulAdd(hn::Add(far, far), margin2, margin1);
    return q;
  }

  /// What sums of terms may lose, relative to the sum of their sizes.
  HWY_INLINE V sum_unit() const { return set((24.0 + double(m_count)) * kDoubleRoundoff); }

  /// METHODS 4.3, rounding included.
  HWY_INLINE LaneBounds bounds(V t0, V t1) const {
    const V zero = set(0.0), half = set(0.5);
    LaneBounds sum{zero, zero, zero, zero};
    V size = zero, slope_size = zero;
    const auto add = [&](double factor, V low, V high, V slope_low, V slope_high) HWY_ATTR {
      const V f = set(factor), f_size = set(factor < 0 ? -factor : factor);
      sum.low = hn::MulAdd(f, factor < 0 ? high : low, sum.low);
      sum.high = hn::MulAdd(f, factor < 0 ? low : high, sum.high);
      sum.slope_low = hn::MulAdd(f, factor < 0 ? slope_high : slope_low, sum.slope_low);
      sum.slope_high = hn::MulAdd(f, factor < 0 ? slope_low : slope_high, sum.slope_high);
      size = hn::MulAdd(f_size, hn::Max(hn::Abs(low), hn::Abs(high)), size);
      slope_size = hn::MulAdd(f_size, hn::Max(hn::Abs(slope_low), hn::Abs(slope_high)), slope_size);
    };
    for (size_t n = 0; n < m_count; ++n) {
      const LaneQuadratic& q = m_terms[n];
      const V u0 = hn::Sub(t0, q.at), u1 = hn::Sub(t1, q.at);
      const V q0 = hn::MulAdd(u0, hn::MulAdd(q.a, u0, q.b), q.c);
      const V q2 = hn::MulAdd(u1, hn::MulAdd(q.a, u1, q.b), q.c);
      const V q1 = hn::MulAdd(hn::Mul(q.a, u0), u1, hn::MulAdd(hn::Mul(half, q.b), hn::Add(u0, u1), q.c));
      const V low = hn::Sub(hn::Min(q1, hn::Min(q0, q2)), q.margin);
      const V high = hn::Add(hn::Max(q1, hn::Max(q0, q2)), q.margin);
      const V twice_a = hn::Add(q.a, q.a);
      const V s0 = hn::MulAdd(twice_a, u0, q.b), s1 = hn::MulAdd(twice_a, u1, q.b);
      const V slope_low = hn::Sub(hn::Min(s0, s1), q.slope_margin);
      const V slope_high = hn::Add(hn::Max(s0, s1), q.slope_margin);
      if (n < m_base_count) {
        add(q.factor, low, high, slope_low, slope_high);
        continue;
      }
      const V least = hn::Max(low, zero), most = hn::Max(high, zero);
      const V least2 = hn::Mul(least, least), most2 = hn::Mul(most, most), three = set(3.0);
      const V steepest_fall = hn::Mul(three, hn::IfThenElse(hn::Lt(slope_low, zero), most2, least2));
      const V steepest_rise = hn::Mul(three, hn::IfThenElse(hn::Gt(slope_high, zero), most2, least2));
      add(q.factor, hn::Mul(least2, least), hn::Mul(most2, most), hn::Mul(steepest_fall, slope_low),
          hn::Mul(steepest_rise, slope_high));
    }
    const V lost = hn::Mul(sum_unit(), size), slope_lost = hn::Mul(sum_unit(), slope_size);
    return {hn::Sub(sum.low, lost), hn::Add(sum.high, lost), hn::Sub(sum.slope_low, slope_lost),
            hn::Add(sum.slope_high, slope_lost)};
  }

  HWY_INLINE LaneValue value(V t) const {
    const V zero = set(0.0), three = set(3.0);
    LaneValue sum{zero, zero, zero};
    V size = zero;
    for (size_t n = 0; n < m_count; ++n) {
      const LaneQuadratic& q = m_terms[n];
      const V u = hn::Sub(t, q.at), factor = set(q.factor), factor_size = hn::Abs(factor);
      const V at = hn::MulAdd(u, hn::MulAdd(q.a, u, q.b), q.c);
      const V slope = hn::MulAdd(hn::Add(q.a, q.a), u, q.b);
      if (n < m_base_count) {
        sum.f = hn::MulAdd(factor, at, sum.f);
        sum.slope = hn::MulAdd(factor, slope, sum.slope);
        sum.margin = hn::MulAdd(factor_size, q.margin, sum.margin);
        size = hn::MulAdd(factor_size, hn::Abs(at), size);
        continue;
      }
      const V positive = hn::Max(at, zero), most = hn::Max(hn::Add(at, q.margin), zero);
      const V weighted = hn::Mul(factor, hn::Mul(positive, positive));
      const V weighted_most = hn::Mul(factor_size, hn::Mul(most, most));
      sum.f = hn::MulAdd(weighted, positive, sum.f);
      sum.slope = hn::MulAdd(hn::Mul(three, weighted), slope, sum.slope);
      sum.margin = hn::MulAdd(hn::Mul(three, weighted_most), q.margin, sum.margin);
      size = hn::MulAdd(weighted_most, most, size);
    }
    sum.margin = hn::MulAdd(sum_unit(), size, sum.margin);
    return sum;
  }

  /// From the near end on, in steps that are shares of the stretch.
  HWY_INLINE V walk() const {
    const D d;
    const V one = set(1.0), zero = set(0.0), length = hn::Sub(m_t1, m_t0);
    const LaneValue first = value(m_t0);
    M is_on_surface = hn::Le(hn::Abs(first.f), first.margin);
    M todo = hn::Or(is_on_surface, hn::Lt(first.f, zero));
    M crossed = hn::Lt(one, zero);
    V start = zero, step = one, result = set(kUndecided), from = m_t0, to = m_t0;
    for (int n = 0; n < kMostStretches && !hn::AllFalse(d, todo); ++n) {
      const V end = hn::Add(start, step);
      const V t0 = hn::MulAdd(start, length, m_t0);
      const V t1 = hn::IfThenElse(hn::Lt(end, one), hn::MulAdd(end, length, m_t0), m_t1);
      const LaneBounds f = bounds(t0, t1);
      M passed = hn::And(todo, hn::Or(hn::Lt(f.high, zero), hn::Lt(f.slope_high, zero)));
      const M rises = hn::AndNot(passed, hn::And(todo, hn::Gt(f.slope_low, zero)));
      const M is_inside = hn::AndNot(passed, hn::And(todo, hn::Gt(f.low, zero)));
      // A ray that starts on the surface and leads inwards; or one that got inside unseen.
      M left = hn::And(is_on_surface, hn::Or(rises, is_inside));
      if (!hn::AllFalse(d, hn::AndNot(is_on_surface, rises))) {
        const LaneValue last = value(t1);
        passed =
            hn::Or(passed, hn::And(hn::AndNot(is_on_surface, rises), hn::Lt(last.f, hn::Neg(last.margin))));
        const M enters = hn::And(hn::AndNot(is_on_surface, rises), hn::Gt(last.f, last.margin));
        from = hn::IfThenElse(enters, t0, from);
        to = hn::IfThenElse(enters, t1, to);
        crossed = hn::Or(crossed, enters);
        todo = hn::AndNot(enters, todo);
      }
      if (m_asked == Asked::whether) {
        const M enters = hn::AndNot(is_on_surface, hn::And(is_inside, todo));
        crossed = hn::Or(crossed, enters);
        todo = hn::AndNot(enters, todo);
      }
      const M is_short = hn::AndNot(passed, hn::And(todo, hn::Lt(step, set(kShortest))));
      todo = hn::AndNot(hn::Or(left, is_short), todo);
      passed = hn::And(passed, todo);
      const M is_through = hn::And(passed, hn::Ge(end, one));
      result = hn::IfThenElse(is_through, set(kEnd), result);
      todo = hn::AndNot(is_through, todo);
      // Behind a step that is passed comes its sibling, behind that a longer one.
      is_on_surface = hn::AndNot(passed, is_on_surface);
      start = hn::IfThenElse(passed, end, start);
      const V longer = hn::Add(step, step), pairs = hn::Div(start, longer);
      const M fits = hn::Eq(hn::Floor(pairs), pairs);
      step = hn::IfThenElse(passed, hn::IfThenElse(fits, longer, step), hn::Mul(set(0.5), step));
    }
    if (m_asked == Asked::whether) return hn::IfThenElse(crossed, zero, result);
    if (hn::AllFalse(d, crossed)) return result;
    return hn::IfThenElse(crossed, entry(from, to, crossed), result);
  }

  /// The one crossing where the form rises from below 0 to above: Newton's steps from the chord's, halving
  /// where they leave the bracket.
  HWY_INLINE V entry(V from, V to, M todo) const {
    const D d;
    const V half = set(0.5), zero = set(0.0);
    V result = set(kUndecided);
    const V f0 = hn::Min(value(from).f, zero), f1 = value(to).f;
    V at = hn::MulAdd(hn::Sub(to, from), hn::Div(f0, hn::Sub(f0, f1)), from);
    for (int n = 0; n < kMostNewton && !hn::AllFalse(d, todo); ++n) {
      const V middle = hn::Mul(half, hn::Add(from, to));
      at = hn::IfThenElse(hn::And(hn::Lt(from, at), hn::Lt(at, to)), at, middle);
      const M is_point = hn::Not(hn::And(hn::Lt(from, at), hn::Lt(at, to)));
      const LaneValue here = value(at);
      const M is_inside = hn::Ge(here.f, zero);
      from = hn::IfThenElse(is_inside, from, at);
      to = hn::IfThenElse(is_inside, at, to);
      const V next = hn::Sub(at, hn::Div(here.f, here.slope));
      const M is_near = hn::Le(hn::Abs(hn::Sub(next, at)), hn::Mul(set(4 * kDoubleRoundoff), hn::Abs(at)));
      const M is_zero = hn::Le(hn::Abs(here.f), here.margin);
      const M is_done = hn::And(todo, hn::Or(is_point, hn::Or(is_near, is_zero)));
      M takes_next = hn::AndNot(is_point, hn::And(hn::Le(from, next), hn::Le(next, to)));
      // Where the form hardly rises the last step leads anywhere.
      const M is_doubtful = hn::And(is_done, hn::AndNot(is_near, is_zero));
      if (!hn::AllFalse(d, is_doubtful)) {
        const M is_better = hn::Le(hn::Abs(value(next).f), hn::Abs(here.f));
        takes_next = hn::And(takes_next, hn::Or(hn::Not(is_doubtful), is_better));
      }
      result = hn::IfThenElse(is_done, hn::IfThenElse(takes_next, next, at), result);
      todo = hn::AndNot(is_done, todo);
      at = n % 8 == 7 ? hn::Mul(half, hn::Add(from, to)) : next;
    }
    return result;
  }

  std::span<const FormTerm> m_base;
  std::span<const FormTerm* const> m_perturbations;
  Asked m_asked;
  CrossingRays& m_rays;

  // The rays in hand.
  V3 m_point, m_rest, m_d;
  V m_rounding, m_t0, m_t1;
  std::array<LaneQuadratic, kMostTerms> m_terms;
  size_t m_base_count = 0, m_count = 0;
};

void find_crossings_impl(std::span<const FormTerm> base, std::span<const FormTerm* const> perturbations,
                         Asked asked, CrossingRays& rays) {
  CrossingKernel(base, perturbations, asked, rays).run();
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pileus {

HWY_EXPORT(find_crossings_impl);

void CrossingRays::add(const AnchoredRay& ray, const Segment& local) {
  for (int axis = 0; axis < 3; ++axis) {
    point[axis][count] = ray.point[axis];
    rest[axis][count] = ray.rest[axis];
    d[axis][count] = ray.d[axis];
  }
  rounding[count] = ray.rounding;
  t0[count] = local.t0;
  t1[count] = local.t1;
  ++count;
}

void find_crossings(std::span<const FormTerm> base, std::span<const FormTerm* const> perturbations,
                    Asked asked, CrossingRays& rays) {
  HWY_DYNAMIC_DISPATCH(find_crossings_impl)(base, perturbations, asked, rays);
}

}  // namespace pileus
#endif
