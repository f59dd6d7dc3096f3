#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace pileus {

/// All numbers from lo to hi: what a quantity can be in a region.
struct Interval {
  double lo = 0.0, hi = 0.0;

  static Interval everything() {
    return {-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  }

  bool contains(double x) const { return lo <= x && x <= hi; }
  double width() const { return hi - lo; }
  double magnitude() const { return std::max(std::fabs(lo), std::fabs(hi)); }

  /// The interval with a margin on both sides; everything where that is not a number.
  Interval widened(double margin) const {
    const Interval wide{lo - margin, hi + margin};
    return wide.lo <= wide.hi ? wide : everything();
  }
};

inline Interval operator+(const Interval& a, const Interval& b) {
  return {a.lo + b.lo, a.hi + b.hi};
}

inline Interval operator*(double factor, const Interval& a) {
  return factor < 0 ? Interval{factor * a.hi, factor * a.lo} : Interval{factor * a.lo, factor * a.hi};
}

/// The least interval that holds both.
inline Interval hull(const Interval& a, const Interval& b) {
  return {std::min(a.lo, b.lo), std::max(a.hi, b.hi)};
}

/// What both hold, where they meet.
inline Interval intersection(const Interval& a, const Interval& b) {
  return {std::max(a.lo, b.lo), std::min(a.hi, b.hi)};
}

/// |x| for all x in a.
inline Interval abs(const Interval& a) {
  if (a.lo >= 0) return a;
  if (a.hi <= 0) return {-a.hi, -a.lo};
  return {0.0, std::max(-a.lo, a.hi)};
}

/// x^2 for all x in a.
inline Interval square(const Interval& a) {
  const Interval size = abs(a);
  return {size.lo * size.lo, size.hi * size.hi};
}

}  // namespace pileus
