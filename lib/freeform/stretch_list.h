#pragma once

#include <algorithm>
#include <optional>
#include <utility>

#include "lib/math/segments.h"

namespace pileus {

/// Turns what is told of the sign of a function, from near to far, into stretches where it is not negative.
/// Whatever is told, entries and exits alternate.
class StretchList {
 public:
  /// For what lies in a segment, its parameter counted from the middle. Of `first_only` nothing but the first
  /// crossing is kept.
  StretchList(const Segment& segment, bool first_only) : m_segment(segment), m_first_only(first_only) {}

  double middle() const { return 0.5 * m_segment.t0 + 0.5 * m_segment.t1; }

  /// The segment as counted from its middle.
  Segment local() const { return {-0.5 * m_segment.length(), 0.5 * m_segment.length()}; }

  /// From t on, counted from the middle, the sign is this.
  void sign_from(double t, bool is_inside) {
    if (m_has_sign && is_inside == m_is_inside) return;
    const Segment whole = local();
    const double at = t <= whole.t0   ? m_segment.t0
                      : t >= whole.t1 ? m_segment.t1
                                      : std::clamp(middle() + t, m_segment.t0, m_segment.t1);
    if (m_has_sign && !m_first) m_first = at;
    if (m_is_inside) append(m_inside, {m_entry, at});
    m_entry = at;
    m_is_inside = is_inside;
    m_has_sign = true;
  }

  /// True where nothing more needs to be told.
  bool is_done() const { return m_first_only && m_first; }

  /// The first change of sign.
  const std::optional<double>& first() const { return m_first; }

  /// All stretches; one that has not ended does so where the segment does.
  Segments finish() {
    sign_from(local().t1, false);
    return std::move(m_inside);
  }

 private:
  Segment m_segment;
  bool m_first_only;
  bool m_has_sign = false, m_is_inside = false;
  double m_entry = 0.0;
  std::optional<double> m_first;
  Segments m_inside;
};

}  // namespace pileus
