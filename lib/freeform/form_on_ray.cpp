#include "lib/freeform/form_on_ray.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "lib/freeform/form_bounds.h"
#include "lib/freeform/form_program.h"

namespace pileus {

namespace {

constexpr double kRoundings = 48.0;  ///< as in quadric.cpp
constexpr double kTiny = 1e-300;

Vec3d absolute(const Vec3d& v) {
  return {std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)};
}

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

/// One ray, its parameter counted from the middle of a segment: nothing is lost where the ray starts far
/// away.
class RaySolver {
 public:
  RaySolver(const FreeForm& form, const Ray& ray, const Segment& segment)
      : m_program(form.program()),
        m_middle(0.5 * segment.t0 + 0.5 * segment.t1),
        m_half(0.5 * segment.length()),
        m_o(ray.at(m_middle)),
        m_d(ray.d) {}

  RayRange range() const { return range(m_program.root(), {-m_half, m_half}); }

  Segments inside() const {
    Segments result;
    for (const Segment& part : inside(m_program.root())) {
      const auto absolute_t = [&](double t) { return m_middle + t; };
      append(result, {absolute_t(part.t0), absolute_t(part.t1)});
    }
    return result;
  }

 private:
  RayRange range(int index, const Interval& t) const {
    return evaluate(m_program, index, RayAlgebra{m_o, m_d, t});
  }
  double f(int index, double t) const { return evaluate_at(m_program, index, m_o + t * m_d); }

  Segments inside(int index) const {
    const FormNode& node = m_program.nodes[size_t(index)];
    if (node.kind != FormNode::Kind::joined || !node.blend.is_sharp()) return solve(index);
    const Segments a = inside(node.a), b = inside(node.b);
    switch (node.join) {
      case Join::unite:
        return unite(a, b);
      case Join::intersect:
        return intersect(a, b);
      case Join::subtract:
        return subtract(a, b);
    }
    return {};
  }

  /// A stretch to look at, and how wide the bounds were over the one that it is half of.
  struct Piece {
    Interval t;
    double width_before;
  };

  Segments solve(int index) const {
    Segments found;
    std::vector<Piece> stack{{{-m_half, m_half}, std::numeric_limits<double>::infinity()}};
    for (int looks = 0; !stack.empty(); ++looks) {
      const auto [t, width_before] = stack.back();
      stack.pop_back();
      const RayRange bounds = range(index, t);
      if (bounds.f.hi < 0) continue;
      if (bounds.f.lo > 0) {
        append(found, {t.lo, t.hi});
        continue;
      }
      const double middle = 0.5 * t.lo + 0.5 * t.hi, width = bounds.f.width();
      const bool is_monotone = bounds.slope.lo > 0 || bounds.slope.hi < 0;
      // Where halving tells no more, rounding is all there is: f is 0 all along.
      const bool is_flat = t.width() < m_half * kShort && width > 0.9 * width_before;
      const bool is_point = t.width() < m_half * kShortest || !(t.lo < middle && middle < t.hi);
      if (is_monotone || is_flat || is_point || looks > kMostLooks) {
        append(found, part_inside(index, t));
        continue;
      }
      stack.push_back({{middle, t.hi}, width});
      stack.push_back({{t.lo, middle}, width});
    }
    return found;
  }

  /// The part inside of an interval with one crossing at most.
  Segment part_inside(int index, const Interval& t) const {
    const bool starts_inside = f(index, t.lo) >= 0, ends_inside = f(index, t.hi) >= 0;
    if (starts_inside && ends_inside) return {t.lo, t.hi};
    if (!starts_inside && !ends_inside) return {};
    const double root = crossing(index, t, starts_inside);
    return starts_inside ? Segment{t.lo, root} : Segment{root, t.hi};
  }

  /// Where f changes its sign: secants that keep the root bracketed, halving where they are slow.
  double crossing(int index, Interval t, bool starts_inside) const {
    double at_lower = f(index, t.lo), at_upper = f(index, t.hi);
    for (int step = 0; step < 200; ++step) {
      const bool halves = step % 3 == 2;
      double next =
          halves ? 0.5 * t.lo + 0.5 * t.hi : t.lo - at_lower * ((t.hi - t.lo) / (at_upper - at_lower));
      if (!(t.lo < next && next < t.hi)) next = 0.5 * t.lo + 0.5 * t.hi;
      if (!(t.lo < next && next < t.hi)) break;
      const double value = f(index, next);
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

  static constexpr double kShort = 0x1p-10, kShortest = 0x1p-44;  ///< of half the segment
  static constexpr int kMostLooks = 100'000;

  const FormProgram& m_program;
  double m_middle, m_half;
  Vec3d m_o, m_d;
};

}  // namespace

RayRange range_on_ray(const FreeForm& form, const Ray& ray, const Segment& segment) {
  return RaySolver(form, ray, segment).range();
}

Segments inside(const FreeForm& form, const Ray& ray, const Segment& segment) {
  if (segment.empty()) return {};
  return RaySolver(form, ray, segment).inside();
}

}  // namespace pileus
