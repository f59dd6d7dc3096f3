#pragma once

#include <algorithm>
#include <vector>

#include "lib/math/ray.h"

namespace pileus {

/// Stretches of a ray: sorted, disjoint, none empty, none touching the next.
using Segments = std::vector<Segment>;

/// Appends a stretch that starts nowhere before the last one does; an empty one is dropped, one that touches
/// or overlaps the last is merged with it.
inline void append(Segments& segments, const Segment& next) {
  if (next.empty()) return;
  if (!segments.empty() && next.t0 <= segments.back().t1) {
    segments.back().t1 = std::max(segments.back().t1, next.t1);
  } else {
    segments.push_back(next);
  }
}

inline Segments unite(const Segments& a, const Segments& b) {
  Segments result;
  for (size_t i = 0, j = 0; i < a.size() || j < b.size();) {
    const bool takes_a = j == b.size() || (i < a.size() && a[i].t0 <= b[j].t0);
    append(result, takes_a ? a[i++] : b[j++]);
  }
  return result;
}

inline Segments intersect(const Segments& a, const Segments& b) {
  Segments result;
  for (size_t i = 0, j = 0; i < a.size() && j < b.size();) {
    append(result, {std::max(a[i].t0, b[j].t0), std::min(a[i].t1, b[j].t1)});
    a[i].t1 < b[j].t1 ? ++i : ++j;
  }
  return result;
}

/// a without b
inline Segments subtract(const Segments& a, const Segments& b) {
  Segments result;
  size_t j = 0;
  for (Segment rest : a) {
    while (j < b.size() && b[j].t1 <= rest.t0) ++j;
    for (size_t k = j; k < b.size() && b[k].t0 < rest.t1; ++k) {
      if (rest.t0 < b[k].t0) result.push_back({rest.t0, b[k].t0});
      rest.t0 = std::max(rest.t0, b[k].t1);
    }
    if (!rest.empty()) result.push_back(rest);
  }
  return result;
}

}  // namespace pileus
