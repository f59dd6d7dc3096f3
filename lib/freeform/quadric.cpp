#include "lib/freeform/quadric.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "lib/math/absolute.h"
#include "lib/math/roots.h"

namespace pileus {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kUnitRoundoff = std::numeric_limits<double>::epsilon() / 2;

/// Roundings between the coordinates of a point and a sum of ten terms or a bound of it, each relative to the
/// sum of absolute terms: 5 for a local coordinate, twice in a product, 3 for the product, 10 for the sum; as
/// many again for the expansion about a centre.
constexpr double kRoundings = 48.0;

/// Where products underflow, an error may be larger than any multiple of them.
constexpr double kTiny = 1e-300;

/// Maximum of g v + a v² over |v| <= h.
double axis_maximum(double g, double a, double h) {
  const bool peaks_inside = a < 0 && std::fabs(g) < -2 * a * h;
  return peaks_inside ? -g * g / (4 * a) : std::fabs(g) * h + a * h * h;
}

/// The quadratic form of local coordinates as one of offsets in space.
QuadricCoefficients second_order(const Frame& frame, const QuadricCoefficients& local) {
  const Vec3d &x = frame.row(0), &y = frame.row(1), &z = frame.row(2);
  const auto entry = [&](int i, int j) {  // of the matrix whose off-diagonal entries are half cross terms
    return local.a11 * x[i] * x[j] + local.a22 * y[i] * y[j] + local.a33 * z[i] * z[j] +
           0.5 * (local.a12 * (x[i] * y[j] + y[i] * x[j]) + local.a13 * (x[i] * z[j] + z[i] * x[j]) +
                  local.a23 * (y[i] * z[j] + z[i] * y[j]));
  };
  return {
      entry(0, 0), entry(1, 1), entry(2, 2), 2 * entry(0, 1), 2 * entry(0, 2), 2 * entry(1, 2), 0, 0, 0, 0};
}

/// factor * x, with 0 for a factor of 0 even where x is infinite.
double scaled(double factor, double x) {
  return factor == 0.0 ? 0.0 : factor * x;
}

Interval scaled(double factor, const Interval& x) {
  const double a = scaled(factor, x.lo), b = scaled(factor, x.hi);
  return {std::min(a, b), std::max(a, b)};
}

/// Maximum of a x² + g x over an interval.
double maximum(double a, double g, const Interval& x) {
  const auto value = [&](double at) {
    return std::isinf(at) ? (a != 0.0   ? std::copysign(kInfinity, a)
                             : g == 0.0 ? 0.0
                                        : std::copysign(kInfinity, g * at))
                          : a * at * at + g * at;
  };
  const double ends = std::max(value(x.lo), value(x.hi));
  const double peak = a < 0 ? -g / (2 * a) : kInfinity;
  return x.contains(peak) ? std::max(ends, value(peak)) : ends;
}

/// The x of an interval with a x² + g x + k >= 0, as an interval; lower > upper where there is none.
Interval where_not_negative(double a, double g, double k, const Interval& x) {
  Interval part = Interval::everything();
  if (std::isinf(k)) return k > 0 ? x : Interval{1, -1};
  if (a < 0) {
    const Roots<double> roots = quadratic_roots(a, g, k);
    if (roots.count < 2) return {1, -1};
    part = {roots.t[0], roots.t[1]};
  } else if (a == 0) {
    if (g > 0) part.lo = -k / g;
    if (g < 0) part.hi = -k / g;
    if (g == 0 && k < 0) return {1, -1};
  }
  return {std::max(x.lo, part.lo), std::min(x.hi, part.hi)};
}

}  // namespace

QuadricCoefficients absolute(const QuadricCoefficients& q) {
  return {std::fabs(q.a11), std::fabs(q.a22), std::fabs(q.a33), std::fabs(q.a12), std::fabs(q.a13),
          std::fabs(q.a23), std::fabs(q.a14), std::fabs(q.a24), std::fabs(q.a34), std::fabs(q.a44)};
}

Box3d everywhere() {
  return {Vec3d(-kInfinity), Vec3d(kInfinity)};
}

double QuadricCoefficients::value(const Vec3d& p) const {
  return a11 * p.x * p.x + a22 * p.y * p.y + a33 * p.z * p.z + a12 * p.x * p.y + a13 * p.x * p.z +
         a23 * p.y * p.z + a14 * p.x + a24 * p.y + a34 * p.z + a44;
}

Vec3d QuadricCoefficients::gradient(const Vec3d& p) const {
  return {2 * a11 * p.x + a12 * p.y + a13 * p.z + a14, 2 * a22 * p.y + a12 * p.x + a23 * p.z + a24,
          2 * a33 * p.z + a13 * p.x + a23 * p.y + a34};
}

double QuadricCoefficients::magnitude(const Vec3d& reach) const {
  return absolute(*this).value(reach);
}

Vec3d QuadricCoefficients::magnitude_gradient(const Vec3d& reach) const {
  return absolute(*this).gradient(reach);
}

Interval QuadricInBox::range(double unit_roundoff) const {
  const QuadricCoefficients& q = about_center;
  const double cross = std::fabs(q.a12) * half.x * half.y + std::fabs(q.a13) * half.x * half.z +
                       std::fabs(q.a23) * half.y * half.z;
  double upper = q.a44 + cross, lower = q.a44 - cross;
  for (int k = 0; k < 3; ++k) {
    upper += axis_maximum(q.linear(k), q.square(k), half[k]);
    lower -= axis_maximum(q.linear(k), -q.square(k), half[k]);
  }
  const double batch_margin = unit_roundoff > 0 ? kRoundings / 2 * unit_roundoff * q.magnitude(half) : 0.0;
  return Interval{lower, upper}.widened(margin + batch_margin);
}

Quadric::Quadric(const Frame& frame, const QuadricCoefficients& coefficients)
    : m_frame(frame), m_local(coefficients), m_second(second_order(frame, coefficients)) {}

QuadricInBox Quadric::about(const Vec3d& point, const Box3d& box) const {
  QuadricInBox result;
  result.half = {std::max(box.max.x - point.x, point.x - box.min.x),
                 std::max(box.max.y - point.y, point.y - box.min.y),
                 std::max(box.max.z - point.z, point.z - box.min.z)};
  result.half *= 1 + 2 * kUnitRoundoff;
  const Vec3d offset = point - m_frame.center();
  const Vec3d local = m_frame.local_from_offset(offset);
  const Vec3d gradient = m_frame.gradient(m_local.gradient(local));
  result.about_center = m_second;
  result.about_center.a14 = gradient.x;
  result.about_center.a24 = gradient.y;
  result.about_center.a34 = gradient.z;
  result.about_center.a44 = m_local.value(local);
  const Vec3d reach = absolute(offset) + result.half;
  const Vec3d local_reach(dot(absolute(m_frame.row(0)), reach), dot(absolute(m_frame.row(1)), reach),
                          dot(absolute(m_frame.row(2)), reach));
  result.margin = kRoundings * kUnitRoundoff * m_local.magnitude(local_reach) + kTiny;
  return result;
}

Box3d Quadric::bounds(double level, const Box3d& clip) const {
  if (m_local.has_cross_terms()) return clip;
  std::array<Interval, 3> local;
  for (int k = 0; k < 3; ++k) {
    Interval sum{0.0, 0.0};
    for (int axis = 0; axis < 3; ++axis) {
      const Interval part = scaled(m_frame.row(k)[axis], Interval{clip.min[axis] - m_frame.center()[axis],
                                                                  clip.max[axis] - m_frame.center()[axis]});
      sum = {sum.lo + part.lo, sum.hi + part.hi};
    }
    local[size_t(k)] = sum;
  }
  // What the other coordinates leave to each, given the best they can do.
  for (int k = 0; k < 3; ++k) {
    double rest = m_local.a44 + level;
    for (int other = 0; other < 3; ++other) {
      if (other != k) rest += maximum(m_local.square(other), m_local.linear(other), local[size_t(other)]);
    }
    Interval& part = local[size_t(k)];
    part = where_not_negative(m_local.square(k), m_local.linear(k), rest, part);
    if (!(part.lo <= part.hi)) return {};
  }
  Box3d box = clip;
  const bool is_ellipsoid = m_local.a11 < 0 && m_local.a22 < 0 && m_local.a33 < 0;
  for (int axis = 0; axis < 3; ++axis) {
    Interval extent{0.0, 0.0};
    for (int k = 0; k < 3; ++k) {
      const Interval part = scaled(m_frame.axis(k)[axis], local[size_t(k)]);
      extent = {extent.lo + part.lo, extent.hi + part.hi};
    }
    if (is_ellipsoid) {  // its own extent is less than that of its turned box
      double peak = m_local.a44 + level, middle = 0.0, variance = 0.0;
      for (int k = 0; k < 3; ++k) {
        const double a = m_local.square(k), g = m_local.linear(k), reach = m_frame.axis(k)[axis];
        peak -= g * g / (4 * a);
        middle -= reach * g / (2 * a);
        variance -= reach * reach / a;
      }
      const double half = std::sqrt(std::max(0.0, peak) * variance);
      extent = {std::max(extent.lo, middle - half), std::min(extent.hi, middle + half)};
    }
    box.min[axis] = std::max(box.min[axis], m_frame.center()[axis] + extent.lo);
    box.max[axis] = std::min(box.max[axis], m_frame.center()[axis] + extent.hi);
    if (!(box.min[axis] <= box.max[axis])) return {};
  }
  return box;
}

}  // namespace pileus
