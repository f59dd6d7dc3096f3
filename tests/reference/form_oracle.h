#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>
#include <vector>

#include "lib/freeform/form_program.h"
#include "lib/math/ray.h"

namespace pileus::reference {

__extension__ typedef __float128 Quad;  // 113 bits

/// A form of quadrics, perturbations and morphs along a ray, from its definition alone: local coordinates in
/// quadruple precision, the rest in T. Proves of stretches that the form is not negative there, or not
/// positive, but for a margin: by Bernstein bounds of pieces between breakpoints, halved until they decide.
template <class T>
class FormOracle {
 public:
  /// The margin: `unit` of every absolute term, and what moving the ray by `unit` of its distance from each
  /// quadric's centre does, both as large as they may be in `reach`.
  FormOracle(const FormProgram& program, const Ray& ray, const Segment& segment, const Segment& reach,
             double unit)
      : m_unit(T(unit)), m_middle(0.5 * segment.t0 + 0.5 * segment.t1) {
    if (!reach.empty()) m_far = T(std::max(std::fabs(reach.t0 - m_middle), std::fabs(reach.t1 - m_middle)));
    add(program, program.root(), ray, T(1));
  }

  /// Whether sign * f >= -margin all over a part of the segment.
  bool holds(const Segment& part, int sign) const {
    const T t0 = T(part.t0) - T(m_middle), t1 = T(part.t1) - T(m_middle);
    std::vector<T> breaks{t0, t1};
    for (const Term& term : m_terms) {
      if (!term.is_cubed) continue;
      for (const T root : roots(term)) {
        if (t0 < root && root < t1) breaks.push_back(root);
      }
    }
    std::sort(breaks.begin(), breaks.end());
    for (size_t k = 0; k + 1 < breaks.size(); ++k) {
      if (breaks[k] < breaks[k + 1] && !holds(breaks[k], breaks[k + 1], T(sign))) return false;
    }
    return true;
  }

 private:
  struct Term {
    bool is_cubed;
    T factor, a, b, c;  ///< factor (c + b t + a t²), or factor max(0, …)³
    T moved;            ///< margin of the quadratic
  };

  static T size(T x) { return x < 0 ? -x : x; }

  void add(const FormProgram& program, int index, const Ray& ray, T weight) {
    const FormNode& node = program.nodes[size_t(index)];
    switch (node.kind) {
      case FormNode::Kind::quadric:
        return add(program.quadrics[size_t(node.first)], ray, weight, false);
      case FormNode::Kind::perturbed:
        for (const Perturbation& bump : program.perturbations_of(node)) {
          add(bump.quadric, ray, weight * T(bump.factor), true);
        }
        return add(program, node.a, ray, weight);
      case FormNode::Kind::morphed:
        add(program, node.a, ray, weight * (1 - T(node.beta)));
        return add(program, node.b, ray, weight * T(node.beta));
      default:
        std::abort();
    }
  }

  void add(const Quadric& quadric, const Ray& ray, T factor, bool is_cubed) {
    const QuadricCoefficients& q = quadric.coefficients();
    T x[3], d[3], row_length[3], distance = 0;
    for (int k = 0; k < 3; ++k) {
      Quad sum = 0, along = 0;
      for (int axis = 0; axis < 3; ++axis) {
        const Quad at = Quad(ray.o[axis]) + Quad(m_middle) * Quad(ray.d[axis]);
        const Quad offset = at - Quad(quadric.frame().center()[axis]);
        sum += Quad(quadric.frame().row(k)[axis]) * offset;
        along += Quad(quadric.frame().row(k)[axis]) * Quad(ray.d[axis]);
        if (k == 0) distance += size(T(offset));
      }
      x[k] = T(sum);
      d[k] = T(along);
      row_length[k] = T(quadric.frame().row(k).length());
    }
    const T square[3] = {T(q.a11), T(q.a22), T(q.a33)}, linear[3] = {T(q.a14), T(q.a24), T(q.a34)};
    const int pairs[3][2] = {{0, 1}, {0, 2}, {1, 2}};
    const T cross[3] = {T(q.a12), T(q.a13), T(q.a23)};
    Term term{is_cubed, factor, 0, 0, T(q.a44), 0};
    T moved0 = size(T(q.a44)), moved1 = 0, moved2 = 0;  // margin in units of m_unit: a polynomial in |t|
    T gradient0[3], gradient1[3];                       // of absolute terms, at |x| + |t| |d|
    for (int k = 0; k < 3; ++k) {
      term.c += (square[k] * x[k] + linear[k]) * x[k];
      term.b += (2 * square[k] * x[k] + linear[k]) * d[k];
      term.a += square[k] * d[k] * d[k];
      moved0 += (size(square[k] * x[k]) + size(linear[k])) * size(x[k]);
      moved1 += (2 * size(square[k] * x[k]) + size(linear[k])) * size(d[k]);
      moved2 += size(square[k]) * d[k] * d[k];
      gradient0[k] = 2 * size(square[k] * x[k]) + size(linear[k]);
      gradient1[k] = 2 * size(square[k] * d[k]);
    }
    for (int n = 0; n < 3; ++n) {
      const int i = pairs[n][0], j = pairs[n][1];
      term.c += cross[n] * x[i] * x[j];
      term.b += cross[n] * (x[i] * d[j] + x[j] * d[i]);
      term.a += cross[n] * d[i] * d[j];
      moved0 += size(cross[n] * x[i] * x[j]);
      moved1 += size(cross[n]) * (size(x[i] * d[j]) + size(x[j] * d[i]));
      moved2 += size(cross[n] * d[i] * d[j]);
      gradient0[i] += size(cross[n] * x[j]);
      gradient0[j] += size(cross[n] * x[i]);
      gradient1[i] += size(cross[n] * d[j]);
      gradient1[j] += size(cross[n] * d[i]);
    }
    for (int k = 0; k < 3; ++k) {  // the point moves by a unit of distance + |t|
      moved0 += gradient0[k] * row_length[k] * distance;
      moved1 += (gradient1[k] * distance + gradient0[k]) * row_length[k];
      moved2 += gradient1[k] * row_length[k];
    }
    term.moved = m_unit * (moved0 + m_far * (moved1 + m_far * moved2));
    m_terms.push_back(term);
  }

  static std::vector<T> roots(const Term& q) {
    const T half_b = q.b / 2, square = half_b * half_b - q.a * q.c;
    if (!(square > 0)) return {};
    T root = T(std::sqrt(double(square)));
    if (root > 0) {
      for (int step = 0; step < 3; ++step) root = (root + square / root) / 2;
    }
    const T sum = -(half_b < 0 ? half_b - root : half_b + root);
    std::vector<T> result;
    if (sum != 0) result.push_back(q.c / sum);
    if (q.a != 0) result.push_back(sum / q.a);
    return result;
  }

  /// f and its margin.
  std::pair<T, T> at(T t) const {
    T f = 0, margin = 0;
    for (const Term& term : m_terms) {
      const T q = term.c + t * (term.b + term.a * t);
      const T moved = term.moved;
      if (!term.is_cubed) {
        f += term.factor * q;
        margin += size(term.factor) * moved;
      } else if (q > -moved) {
        if (q > 0) f += term.factor * q * q * q;
        margin += size(term.factor) *
                  (moved * (3 * q * q + 3 * size(q) * moved + moved * moved) + m_unit * size(q * q * q));
      }
    }
    return {f, margin};
  }

  bool holds(T t0, T t1, T sign) const {
    const T middle = (t0 + t1) / 2;
    std::array<T, 7> b{};
    for (const Term& term : m_terms) {
      const T q0 = term.c + t0 * (term.b + term.a * t0), q2 = term.c + t1 * (term.b + term.a * t1);
      const T q1 = term.c + term.b * middle + term.a * t0 * t1, f = sign * term.factor;
      if (!term.is_cubed) {
        const T elevated[7] = {q0,
                               (2 * q0 + q1) / 3,
                               (6 * q0 + 8 * q1 + q2) / 15,
                               (q0 + 3 * q1 + q2) / 5,
                               (q0 + 8 * q1 + 6 * q2) / 15,
                               (q1 + 2 * q2) / 3,
                               q2};
        for (size_t k = 0; k < 7; ++k) b[k] += f * elevated[k];
      } else if (term.c + middle * (term.b + term.a * middle) > 0) {
        const T cube[7] = {q0 * q0 * q0,
                           q0 * q0 * q1,
                           (q0 * q0 * q2 + 4 * q0 * q1 * q1) / 5,
                           (3 * q0 * q1 * q2 + 2 * q1 * q1 * q1) / 5,
                           (q0 * q2 * q2 + 4 * q1 * q1 * q2) / 5,
                           q1 * q2 * q2,
                           q2 * q2 * q2};
        for (size_t k = 0; k < 7; ++k) b[k] += f * cube[k];
      }
    }
    const auto [f, margin] = at(middle);
    const auto [least, most] = std::minmax_element(b.begin(), b.end());
    if (*least >= -margin / 2) return true;
    if (sign * f < -margin) return false;
    if (*most - *least < margin / 2) return true;
    return holds(t0, middle, sign) && holds(middle, t1, sign);
  }

  T m_unit, m_far = 0;
  double m_middle;
  std::vector<Term> m_terms;
};

}  // namespace pileus::reference
