#include "lib/freeform/plain_form.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "lib/freeform/form_bounds.h"

namespace pileus {

namespace {

/// Roundings in a Bernstein coefficient of degree 6, from those of the quadratics on, relative to the same
/// sum of absolute terms.
constexpr double kUnit = 24 * kDoubleRoundoff;

constexpr int kMostSteps = 100;
constexpr double kShortest = 0x1p-50;  ///< of the whole segment: no stretch is halved any more

using Bernstein = std::array<double, 7>;

/// A perturbation on a stretch of a ray where it acts.
struct Active {
  QuadraticOnRay q;
  double factor;
  Segment stretch;
};

/// The polynomial of a stretch, all of which lies between two breakpoints, and how far rounding may have
/// carried its coefficients.
struct Polynomial {
  int degree;  ///< 2 or 6
  Bernstein b, margins;
};

/// Adds factor q³, q given by its Bernstein coefficients (METHODS 5.2).
void add_cube(Bernstein& b, double factor, const std::array<double, 3>& q) {
  const double q00 = q[0] * q[0], q11 = q[1] * q[1], q22 = q[2] * q[2], q02 = q[0] * q[2];
  b[0] += factor * (q00 * q[0]);
  b[1] += factor * (q00 * q[1]);
  b[2] += factor * (q[0] * (q02 + 4 * q11) * 0.2);
  b[3] += factor * (q[1] * (3 * q02 + 2 * q11) * 0.2);
  b[4] += factor * (q[2] * (q02 + 4 * q11) * 0.2);
  b[5] += factor * (q22 * q[1]);
  b[6] += factor * (q22 * q[2]);
}

/// A quadratic as a polynomial of degree 6.
Bernstein elevated(const std::array<double, 3>& q) {
  return {q[0],
          (2 * q[0] + q[1]) / 3,
          (6 * q[0] + 8 * q[1] + q[2]) / 15,
          (q[0] + 3 * q[1] + q[2]) / 5,
          (q[0] + 8 * q[1] + 6 * q[2]) / 15,
          (q[1] + 2 * q[2]) / 3,
          q[2]};
}

/// Adds what margins of the coefficients of q do to those of factor q³: 3 |factor| (|q| + margin)² margin,
/// rounding of the product included.
void add_cube_margins(Bernstein& b, double factor, const std::array<double, 3>& q,
                      const std::array<double, 3>& margins) {
  std::array<double, 3> p, r;
  for (size_t k = 0; k < 3; ++k) {
    p[k] = std::fabs(q[k]) + margins[k];
    r[k] = 3 * std::fabs(factor) * (margins[k] + kUnit / 3 * p[k]);
  }
  const std::array<double, 5> s{p[0] * p[0], p[0] * p[1], (p[0] * p[2] + 2 * p[1] * p[1]) / 3, p[1] * p[2],
                                p[2] * p[2]};
  b[0] += s[0] * r[0];
  b[1] += (s[0] * r[1] + 2 * s[1] * r[0]) / 3;
  b[2] += (s[0] * r[2] + 8 * s[1] * r[1] + 6 * s[2] * r[0]) / 15;
  b[3] += (s[1] * r[2] + 3 * s[2] * r[1] + s[3] * r[0]) / 5;
  b[4] += (6 * s[2] * r[2] + 8 * s[3] * r[1] + s[4] * r[0]) / 15;
  b[5] += (2 * s[3] * r[2] + s[4] * r[1]) / 3;
  b[6] += s[4] * r[2];
}

/// The signs of coefficients, those within the margin left out.
struct Signs {
  int first = 0, last = 0, changes = 0;

  explicit Signs(const Polynomial& p) {
    for (int k = 0; k <= p.degree; ++k) {
      const double b = p.b[size_t(k)], margin = p.margins[size_t(k)];
      const int sign = b > margin ? 1 : b < -margin ? -1 : 0;
      if (sign == 0) continue;
      if (first == 0) first = sign;
      changes += last != 0 && sign != last;
      last = sign;
    }
  }
};

/// Where the control polygon crosses zero for the first time, as a share of the stretch; coefficients within
/// the margin are left out, lest a zero at the end of the stretch be taken for its one crossing.
double polygon_crossing(const Polynomial& p) {
  int before = -1;
  for (int k = 0; k <= p.degree; ++k) {
    const double next = p.b[size_t(k)];
    if (!(std::fabs(next) > p.margins[size_t(k)])) continue;
    if (before >= 0 && (p.b[size_t(before)] < 0) != (next < 0)) {
      const double here = p.b[size_t(before)];
      return (before + (k - before) * here / (here - next)) / p.degree;
    }
    before = k;
  }
  return 0.5;
}

/// Quadratics of one form along one ray.
class FormAlongRay {
 public:
  FormAlongRay(const AnchoredRay& ray, const Segment& segment, TraceWork& work)
      : m_ray(ray), m_segment(segment), m_work(work) {
    m_base.clear();
    m_active.clear();
  }

  void add_base(const TracedQuadric& quadric, double weight) {
    m_base.push_back({quadric.along(m_ray, m_segment), weight});
  }

  void add_perturbation(const TracedQuadric& quadric, double factor) {
    if (!quadric.may_be_positive(m_ray)) return;
    const QuadraticOnRay q = quadric.along(m_ray, m_segment);
    const QuadraticOnRay::Stretches acts = q.positive(m_segment);
    for (int k = 0; k < acts.count; ++k) m_active.push_back({q, factor, acts.parts[size_t(k)]});
  }

  /// Between breakpoints, near first.
  void trace(StretchList& found) {
    m_breaks.assign({m_segment.t0, m_segment.t1});
    for (const Active& active : m_active) {
      m_breaks.push_back(active.stretch.t0);
      m_breaks.push_back(active.stretch.t1);
    }
    std::sort(m_breaks.begin(), m_breaks.end());
    for (size_t k = 0; k + 1 < m_breaks.size() && !found.is_done(); ++k) {
      if (m_breaks[k] < m_breaks[k + 1]) trace_piece({m_breaks[k], m_breaks[k + 1]}, found);
    }
  }

  void subdivide(double precision, StretchList& found) {
    m_stack.assign({m_segment});
    while (!m_stack.empty() && !found.is_done()) {
      const Segment t = m_stack.back();
      m_stack.pop_back();
      const Interval bounds = range(t);
      const double middle = 0.5 * (t.t0 + t.t1);
      const bool is_short = !(t.length() > precision) || !(t.t0 < middle && middle < t.t1);
      if (bounds.hi < 0) {
        found.sign_from(t.t0, false);
      } else if (bounds.lo > 0 || is_short) {
        found.sign_from(t.t0, true);
      } else {
        m_stack.push_back({middle, t.t1});
        m_stack.push_back({t.t0, middle});
      }
    }
  }

 private:
  struct Base {
    QuadraticOnRay q;
    double weight;
  };

  void trace_piece(const Segment& piece, StretchList& found) {
    m_here.clear();
    const double inside = 0.5 * (piece.t0 + piece.t1);
    for (const Active& active : m_active) {
      if (active.stretch.t0 <= inside && inside < active.stretch.t1) m_here.push_back(&active);
    }
    m_stack.assign({piece});
    while (!m_stack.empty() && !found.is_done()) {
      const Segment t = m_stack.back();
      m_stack.pop_back();
      const Polynomial p = polynomial(t);
      const Signs signs(p);
      if (signs.first == 0) continue;
      const double middle = 0.5 * (t.t0 + t.t1);
      const bool is_point = t.length() < kShortest * m_segment.length() || !(t.t0 < middle && middle < t.t1);
      if (signs.changes > 1 && !is_point) {
        m_stack.push_back({middle, t.t1});
        m_stack.push_back({t.t0, middle});
        continue;
      }
      found.sign_from(t.t0, signs.first > 0);
      if (signs.last != signs.first && !found.is_done()) {
        found.sign_from(crossing(t, p, signs.first > 0), signs.last > 0);
      }
    }
  }

  /// The sum of the quadratics, and the margins of its coefficients.
  std::pair<std::array<double, 3>, std::array<double, 3>> base(const Segment& t) const {
    std::array<double, 3> sum{}, margins{};
    for (const Base& base : m_base) {
      const std::array<double, 3> q = base.q.bernstein(t.t0, t.t1),
                                  moved = base.q.bernstein_margins(t.t0, t.t1);
      for (size_t k = 0; k < 3; ++k) {
        sum[k] += base.weight * q[k];
        margins[k] += std::fabs(base.weight) * (moved[k] + kUnit * std::fabs(q[k]));
      }
    }
    return {sum, margins};
  }

  Polynomial polynomial(const Segment& t) const {
    ++m_work.stretches;
    const auto [sum, margins] = base(t);
    Polynomial p{2, {sum[0], sum[1], sum[2]}, {margins[0], margins[1], margins[2]}};
    if (m_here.empty()) return p;
    p = {6, elevated(sum), elevated(margins)};
    for (const Active* active : m_here) {
      const std::array<double, 3> q = active->q.bernstein(t.t0, t.t1);
      add_cube(p.b, active->factor, q);
      add_cube_margins(p.margins, active->factor, q, active->q.bernstein_margins(t.t0, t.t1));
    }
    return p;
  }

  /// Bounds of every term, added (METHODS 4.3).
  Interval range(const Segment& t) const {
    ++m_work.stretches;
    const auto [sum, margins] = base(t);
    const auto [least, most] = std::minmax_element(sum.begin(), sum.end());
    PerturbedRange f(Interval{*least, *most}.widened(*std::max_element(margins.begin(), margins.end())));
    for (const Active& active : m_active) {
      const Segment part{std::max(t.t0, active.stretch.t0), std::min(t.t1, active.stretch.t1)};
      if (part.empty()) continue;
      const std::array<double, 3> q = active.q.bernstein(part.t0, part.t1);
      const double margin = std::max(active.q.margin(part.t0), active.q.margin(part.t1));
      const bool acts_throughout = part.t0 == t.t0 && part.t1 == t.t1;
      const double lowest = acts_throughout ? std::min({q[0], q[1], q[2]}) - margin : 0.0;
      f.add({lowest, std::max({q[0], q[1], q[2]}) + margin}, active.factor);
    }
    return f.sum(kDoubleRoundoff);
  }

  /// The form at a parameter within the piece in hand.
  struct Value {
    double f, slope, margin;
  };
  Value value(double t) const {
    ++m_work.values;
    Value sum{0, 0, 0};
    for (const Base& base : m_base) {
      const double q = base.q.value(t);
      sum.f += base.weight * q;
      sum.slope += base.weight * base.q.slope(t);
      sum.margin += std::fabs(base.weight) * (base.q.margin(t) + kUnit * std::fabs(q));
    }
    for (const Active* active : m_here) {
      const double q = active->q.value(t), weighted = active->factor * q * q;
      sum.f += weighted * q;
      sum.slope += 3 * weighted * active->q.slope(t);
      sum.margin += 3 * std::fabs(weighted) * (active->q.margin(t) + kUnit * std::fabs(q));
    }
    return sum;
  }

  /// The one change of sign in a stretch: Newton's steps from where the control polygon has its own, halving
  /// where they leave the bracket.
  double crossing(Segment t, const Polynomial& p, bool starts_inside) const {
    double at = t.t0 + polygon_crossing(p) * t.length();
    for (int step = 0; step < kMostSteps; ++step) {
      if (!(t.t0 < at && at < t.t1)) at = 0.5 * (t.t0 + t.t1);
      if (!(t.t0 < at && at < t.t1)) break;
      const Value here = value(at);
      const bool is_zero = std::fabs(here.f) <= here.margin;
      const bool leads_across = (here.slope < 0) == starts_inside;
      // Another zero, at an end of the stretch where the sign is not known, is not the crossing.
      const bool is_before =
          is_zero && !leads_across ? at - t.t0 < t.t1 - at : (here.f >= 0) == starts_inside;
      (is_before ? t.t0 : t.t1) = at;
      const double next = at - here.f / here.slope;
      const bool is_in_bracket = t.t0 <= next && next <= t.t1;
      if (leads_across) {
        if (std::fabs(next - at) <= 4 * kDoubleRoundoff * std::fabs(at)) return is_in_bracket ? next : at;
        if (is_zero) {  // the last step is no better where the form hardly rises: it then leads anywhere
          const bool is_better = is_in_bracket && std::fabs(value(next).f) <= std::fabs(here.f);
          return is_better ? next : at;
        }
      }
      at = step % 8 == 7 ? 0.5 * (t.t0 + t.t1) : next;
    }
    return at;
  }

  const AnchoredRay& m_ray;
  Segment m_segment;
  TraceWork& m_work;

  /// Kept from ray to ray: a thread looks at one form along one ray at a time.
  struct Lists {
    std::vector<Base> base;
    std::vector<Active> active;
    std::vector<const Active*> here;
    std::vector<double> breaks;
    std::vector<Segment> stack;
  };
  static Lists& lists() {
    thread_local Lists lists;
    return lists;
  }
  std::vector<Base>& m_base = lists().base;
  std::vector<Active>& m_active = lists().active;
  std::vector<const Active*>& m_here = lists().here;  ///< those that act on the piece in hand
  std::vector<double>& m_breaks = lists().breaks;
  std::vector<Segment>& m_stack = lists().stack;
};

}  // namespace

bool PlainForm::add(const FormProgram& program, int index, double weight) {
  const FormNode& node = program.nodes[size_t(index)];
  switch (node.kind) {
    case FormNode::Kind::quadric:
      if (weight != 0.0) m_base.push_back({TracedQuadric(program.quadrics[size_t(node.first)]), weight});
      return true;
    case FormNode::Kind::perturbed:
      for (const Perturbation& bump : program.perturbations_of(node)) {
        if (weight * bump.factor == 0.0) continue;
        m_perturbations.push_back({TracedQuadric(bump.quadric), weight * bump.factor});
      }
      return add(program, node.a, weight);
    case FormNode::Kind::morphed:
      return add(program, node.a, weight * (1 - node.beta)) && add(program, node.b, weight * node.beta);
    case FormNode::Kind::joined:
    case FormNode::Kind::deformed:
      return false;
  }
  return false;
}

std::optional<PlainForm> PlainForm::from(const FormProgram& program, int index) {
  PlainForm form;
  if (!form.add(program, index, 1.0)) return std::nullopt;
  return form;
}

void PlainForm::trace(const AnchoredRay& ray, const Segment& segment, StretchList& found,
                      TraceWork& work) const {
  FormAlongRay along(ray, segment, work);
  for (const FormTerm& term : m_base) along.add_base(term.quadric, term.factor);
  for (const FormTerm& term : m_perturbations) along.add_perturbation(term.quadric, term.factor);
  along.trace(found);
}

void PlainForm::subdivide(const AnchoredRay& ray, const Segment& segment, double precision,
                          StretchList& found, TraceWork& work) const {
  FormAlongRay along(ray, segment, work);
  for (const FormTerm& term : m_base) along.add_base(term.quadric, term.factor);
  for (const FormTerm& term : m_perturbations) along.add_perturbation(term.quadric, term.factor);
  along.subdivide(precision, found);
}

FormAtPoint PlainForm::at(const Vec3d& p) const {
  FormAtPoint sum;
  for (const FormTerm& term : m_base) {
    const TracedQuadric::AtPoint q = term.quadric.at(p);
    sum.value += term.factor * q.value;
    sum.gradient += term.factor * q.gradient;
    sum.margin += std::fabs(term.factor) * (q.margin + kUnit * std::fabs(q.value));
  }
  for (const FormTerm& term : m_perturbations) {
    if (!term.quadric.may_be_positive(p)) continue;
    const TracedQuadric::AtPoint q = term.quadric.at(p);
    const double most = std::max(0.0, q.value + q.margin), positive = std::max(0.0, q.value);
    sum.value += term.factor * positive * positive * positive;
    sum.gradient += 3 * term.factor * positive * positive * q.gradient;
    sum.margin += 3 * std::fabs(term.factor) * most * most * (q.margin + kUnit * most);
  }
  return sum;
}

}  // namespace pileus
