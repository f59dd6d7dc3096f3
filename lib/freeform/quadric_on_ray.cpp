#include "lib/freeform/quadric_on_ray.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "lib/freeform/form_bounds.h"
#include "lib/math/absolute.h"
#include "lib/math/two_product.h"

namespace pileus {

namespace {

/// The form of second order, d'Ad.
double second_order(const QuadricCoefficients& q, const Vec3d& d) {
  const double squares = q.a11 * d.x * d.x + q.a22 * d.y * d.y + q.a33 * d.z * d.z;
  if (!q.has_cross_terms()) return squares;
  return squares + q.a12 * d.x * d.y + q.a13 * d.x * d.z + q.a23 * d.y * d.z;
}

double clamped(double t, const Segment& within) {
  return t < within.t0 ? within.t0 : t > within.t1 ? within.t1 : t;
}

/// Square of the longest half axis of an ellipsoid about its frame's centre, the frame's axes at right
/// angles; nothing for other quadrics.
std::optional<double> longest_half_axis_square(const Quadric& quadric) {
  const QuadricCoefficients& q = quadric.coefficients();
  const Frame& frame = quadric.frame();
  double longest = 0.0;
  for (int k = 0; k < 3; ++k) {
    const Vec3d &axis = frame.axis(k), &next = frame.axis((k + 1) % 3);
    const bool is_right = std::fabs(dot(axis, next)) <= 1e-10 * length(axis) * length(next);
    if (!is_right || !(q.square(k) < 0) || q.linear(k) != 0.0) return std::nullopt;
    longest = std::max(longest, axis.length2() * q.a44 / -q.square(k));
  }
  if (q.has_cross_terms()) return std::nullopt;
  return longest;
}

}  // namespace

AnchoredRay::AnchoredRay(const Ray& ray, double t) : d(ray.d) {
  double size = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const TwoProduct<double> way = two_product(t, ray.d[axis]);
    const double o = ray.o[axis], sum = o + way.value, back = sum - o;
    point[axis] = sum;
    rest[axis] = (o - (sum - back)) + (way.value - back) + way.error;
    size += std::fabs(o) + std::fabs(way.value);
  }
  rounding = 4 * kDoubleRoundoff * kDoubleRoundoff * size;
}

QuadraticOnRay::Stretches QuadraticOnRay::positive(const Segment& within) const {
  Stretches result;
  const auto add = [&](double u0, double u1) {
    const Segment part{std::max(within.t0, at + u0), std::min(within.t1, at + u1)};
    if (!part.empty()) result.parts[size_t(result.count++)] = part;
  };
  constexpr double kEnd = std::numeric_limits<double>::infinity();
  const double half_b = 0.5 * b, square = half_b * half_b - a * c;
  if (a == 0.0 && b == 0.0) {
    if (c > 0) add(-kEnd, kEnd);
  } else if (square <= 0) {
    if (a > 0) add(-kEnd, kEnd);
  } else {
    const double sum = -(half_b + std::copysign(std::sqrt(square), half_b));
    double first = c / sum, second = a == 0.0 ? first : sum / a;
    if (first > second) std::swap(first, second);
    if (a < 0) {
      add(first, second);
    } else if (a > 0) {
      add(-kEnd, first);
      add(second, kEnd);
    } else if (b > 0) {
      add(first, kEnd);
    } else {
      add(-kEnd, first);
    }
  }
  return result;
}

TracedQuadric::TracedQuadric(const Quadric& quadric)
    : m_center(quadric.frame().center()),
      m_rows{quadric.frame().row(0), quadric.frame().row(1), quadric.frame().row(2)},
      m_row_lengths(length(m_rows[0]), length(m_rows[1]), length(m_rows[2])),
      m_q(quadric.coefficients()),
      m_absolute(absolute(m_q)),
      m_ball_center(m_center),
      m_bounds(quadric.bounds(0.0, everywhere())),
      m_ball_square(0.0) {
  const Box3d& box = m_bounds;
  if (const auto longest = longest_half_axis_square(quadric)) {
    m_ball_square = *longest;
  } else if (!box.isEmpty()) {
    m_ball_center = 0.5 * box.min + 0.5 * box.max;
    m_ball_square = 0.25 * (box.max - box.min).length2();
    if (!std::isfinite(m_ball_square)) m_ball_square = std::numeric_limits<double>::infinity();
  }
  m_ball_square *= 1 + 1e-8;  // more than rounding may take
}

bool TracedQuadric::may_be_positive(const AnchoredRay& ray) const {
  const Vec3d w = ray.point - m_ball_center;
  const Vec3d across = w - dot(w, ray.d) * ray.d;
  return !(across.length2() > m_ball_square + 1e-14 * w.length2());
}

QuadraticOnRay TracedQuadric::along(const AnchoredRay& ray, const Segment& within) const {
  const Vec3d w = (ray.point - m_center) + ray.rest;
  const Vec3d x(dot(m_rows[0], w), dot(m_rows[1], w), dot(m_rows[2], w));
  const Vec3d d(dot(m_rows[0], ray.d), dot(m_rows[1], ray.d), dot(m_rows[2], ray.d));
  QuadraticOnRay q;
  q.a = second_order(m_q, d);
  q.at = clamped(-dot(x, d) / d.length2(), within);
  const Vec3d nearest = x + q.at * d;
  q.b = dot(m_q.gradient(nearest), d);
  q.c = m_q.value(nearest);

  // Terms round by `unit` of their size, points of the ray by `unit` of their distance from the centre.
  constexpr double unit = kRoundings * kDoubleRoundoff;
  const Vec3d size = absolute(nearest), speed = absolute(d);
  const double moved = unit * (length(w) + std::fabs(q.at)) + ray.rounding;
  const Vec3d slope = m_absolute.gradient(size), linear(m_absolute.a14, m_absolute.a24, m_absolute.a34);
  const double rise = dot(slope, m_row_lengths),
               bend = dot(m_absolute.gradient(speed) - linear, m_row_lengths);
  q.margin0 = unit * m_absolute.value(size) + moved * rise;
  q.margin1 = unit * (dot(slope, speed) + rise) + moved * bend;
  q.margin2 = unit * (second_order(m_absolute, speed) + bend);
  return q;
}

TracedQuadric::AtPoint TracedQuadric::at(const Vec3d& p) const {
  const Vec3d w = p - m_center;
  const Vec3d x(dot(m_rows[0], w), dot(m_rows[1], w), dot(m_rows[2], w));
  const Vec3d slope = m_q.gradient(x), size = absolute(x);
  constexpr double unit = kRoundings * kDoubleRoundoff;
  const double moved = unit * length(w) * dot(m_absolute.gradient(size), m_row_lengths);
  return {m_q.value(x), slope.x * m_rows[0] + slope.y * m_rows[1] + slope.z * m_rows[2],
          unit * m_absolute.value(size) + moved};
}

}  // namespace pileus
