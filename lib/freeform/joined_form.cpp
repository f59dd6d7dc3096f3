#include "lib/freeform/joined_form.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "lib/freeform/form_on_ray.h"

namespace pileus {

namespace {

constexpr double kShort = 0x1p-10, kShortest = 0x1p-44;  ///< of half the segment
constexpr int kMostLooks = 100'000;

/// One ray through one form.
class Solver {
 public:
  Solver(const FormProgram& program, const AnchoredRay& ray, const Segment& segment, TraceWork& work)
      : m_program(program), m_ray(ray), m_segment(segment), m_work(work) {}

  void trace(StretchList& found) {
    const double half = 0.5 * m_segment.length();
    std::vector<Piece> stack{{{m_segment.t0, m_segment.t1}, std::numeric_limits<double>::infinity()}};
    for (int looks = 0; !stack.empty() && !found.is_done(); ++looks) {
      const auto [t, width_before] = stack.back();
      stack.pop_back();
      const RayRange bounds = range(t);
      if (bounds.f.hi < 0 || bounds.f.lo > 0) {
        found.sign_from(t.lo, bounds.f.lo > 0);
        continue;
      }
      const double middle = 0.5 * t.lo + 0.5 * t.hi, width = bounds.f.width();
      const bool is_monotone = bounds.slope.lo > 0 || bounds.slope.hi < 0;
      // Where halving tells no more, rounding is all there is: f is 0 all along.
      const bool is_flat = t.width() < half * kShort && width > 0.9 * width_before;
      const bool is_point = t.width() < half * kShortest || !(t.lo < middle && middle < t.hi);
      if (is_monotone || is_flat || is_point || looks > kMostLooks) {
        tell_of_one_crossing(t, found);
        continue;
      }
      stack.push_back({{middle, t.hi}, width});
      stack.push_back({{t.lo, middle}, width});
    }
  }

  void subdivide(double precision, StretchList& found) {
    std::vector<Interval> stack{{m_segment.t0, m_segment.t1}};
    while (!stack.empty() && !found.is_done()) {
      const Interval t = stack.back();
      stack.pop_back();
      const Interval f = range(t).f;
      const double middle = 0.5 * t.lo + 0.5 * t.hi;
      const bool is_short = !(t.width() > precision) || !(t.lo < middle && middle < t.hi);
      if (f.hi < 0 || f.lo > 0 || is_short) {
        found.sign_from(t.lo, !(f.hi < 0));
        continue;
      }
      stack.push_back({middle, t.hi});
      stack.push_back({t.lo, middle});
    }
  }

 private:
  /// A stretch to look at, and how wide the bounds were over the one that it is half of.
  struct Piece {
    Interval t;
    double width_before;
  };

  RayRange range(const Interval& t) const {
    ++m_work.stretches;
    return range_on_line(m_program, m_program.root(), m_ray.point, m_ray.d, t);
  }
  double f(double t) const {
    ++m_work.values;
    return evaluate_at(m_program, m_program.root(), m_ray.point + t * m_ray.d);
  }

  void tell_of_one_crossing(const Interval& t, StretchList& found) const {
    const double at_lower = f(t.lo), at_upper = f(t.hi);
    found.sign_from(t.lo, at_lower >= 0);
    if ((at_lower >= 0) == (at_upper >= 0) || found.is_done()) return;
    found.sign_from(crossing(t, at_lower, at_upper), at_upper >= 0);
  }

  /// Where f changes its sign: secants that keep the root bracketed, halving where they are slow.
  double crossing(Interval t, double at_lower, double at_upper) const {
    const bool starts_inside = at_lower >= 0;
    for (int step = 0; step < 200; ++step) {
      const bool halves = step % 3 == 2;
      double next =
          halves ? 0.5 * t.lo + 0.5 * t.hi : t.lo - at_lower * ((t.hi - t.lo) / (at_upper - at_lower));
      if (!(t.lo < next && next < t.hi)) next = 0.5 * t.lo + 0.5 * t.hi;
      if (!(t.lo < next && next < t.hi)) break;
      const double value = f(next);
      if ((value >= 0) == starts_inside) {
        t.lo = next;
        at_lower = value;
      } else {
        t.hi = next;
        at_upper = value;
      }
    }
    return std::fabs(at_lower) < std::fabs(at_upper) ? t.lo : t.hi;
  }

  const FormProgram& m_program;
  const AnchoredRay& m_ray;
  Segment m_segment;
  TraceWork& m_work;
};

}  // namespace

void JoinedForm::trace(const AnchoredRay& ray, const Segment& segment, StretchList& found,
                       TraceWork& work) const {
  Solver(m_form.program(), ray, segment, work).trace(found);
}

void JoinedForm::subdivide(const AnchoredRay& ray, const Segment& segment, double precision,
                           StretchList& found, TraceWork& work) const {
  Solver(m_form.program(), ray, segment, work).subdivide(precision, found);
}

FormAtPoint JoinedForm::at(const Vec3d& p) const {
  const double value = m_form.value(p);
  const Interval range = m_form.range(Box3d(p));
  return {value, m_form.gradient(p), std::max(range.hi - value, value - range.lo)};
}

}  // namespace pileus
