#include "lib/freeform/deformation.h"

#include <limits>
#include <utility>

#include "lib/freeform/form_bounds.h"
#include "lib/freeform/shapes.h"
#include "lib/math/affine.h"

namespace pileus {

namespace {

double reach(const Box3d& box) {
  double most = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    most = std::max({most, std::fabs(box.min[axis]), std::fabs(box.max[axis])});
  }
  return most;
}

Box3d widened(const Box3d& box, double margin) {
  return {box.min - Vec3d(margin), box.max + Vec3d(margin)};
}

/// Hull of the products of two intervals; 0 times infinity is 0.
Interval product(const Interval& a, const Interval& b) {
  Interval result{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const double x : {a.lo, a.hi}) {
    for (const double y : {b.lo, b.hi}) {
      const double value = x == 0 || y == 0 ? 0.0 : x * y;
      result = {std::min(result.lo, value), std::max(result.hi, value)};
    }
  }
  return result;
}

/// Box of a rectangle (u, v), turned: (c u + s v, c v - s u).
std::pair<Interval, Interval> turned(const Interval& u, const Interval& v, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  const auto sum = [](const Interval& a, const Interval& b) { return Interval{a.lo + b.lo, a.hi + b.hi}; };
  return {sum(product({c, c}, u), product({s, s}, v)), sum(product({c, c}, v), product({-s, -s}, u))};
}

Interval side(const Box3d& box, int axis) {
  return {box.min[axis], box.max[axis]};
}

void set_side(Box3d& box, int axis, const Interval& side) {
  box.min[axis] = side.lo;
  box.max[axis] = side.hi;
}

Interval clipped(const Interval& a, double lower, double upper) {
  return {std::clamp(a.lo, lower, upper), std::clamp(a.hi, lower, upper)};
}

/// Axes of length 1: the third along `axis`, the first as near to `towards` as that allows.
Frame frame_towards(const Vec3d& center, const Vec3d& axis, const Vec3d& towards) {
  const Vec3d z = normalize(axis), y = normalize(cross(z, towards));
  return Frame(center, {cross(y, z), y, z});
}

}  // namespace

Deformation Deformation::twist(const Vec3d& center, const Vec3d& axis, double from, double to, double angle) {
  return Deformation(Kind::twist, frame_along(center, axis, 1.0, 1.0), from, to, angle);
}

Deformation Deformation::taper(const Vec3d& center, const Vec3d& axis, double from, double to,
                               double factor) {
  return Deformation(Kind::taper, frame_along(center, axis, 1.0, 1.0), from, to, factor);
}

Deformation Deformation::bend(const Vec3d& center, const Vec3d& axis, const Vec3d& towards, double from,
                              double to, double angle) {
  const Vec3d side = angle < 0 ? -towards : towards;
  return Deformation(Kind::bend, frame_towards(center, axis, side), from, to, std::fabs(angle));
}

Deformation Deformation::moved(const Affine& map) const {
  return Deformation(m_kind, m_frame.moved(map), m_from, m_to, m_amount);
}

Deformation Deformation::relative_to(const Frame& frame) const {
  return Deformation(m_kind, m_frame.relative_to(frame), m_from, m_to, m_amount);
}

Vec3d Deformation::gradient(const Vec3d& p, const Vec3d& at_origin) const {
  const Vec3d local = m_frame.local_point(p), origin = local_origin(local), &g = at_origin;
  const double span = m_to - m_from, share = std::clamp((local.z - m_from) / span, 0.0, 1.0);
  const bool changes = m_from < local.z && local.z < m_to;
  switch (m_kind) {
    case Kind::twist: {
      const double c = std::cos(m_amount * share), s = std::sin(m_amount * share);
      const double rate = changes ? m_amount / span : 0.0;
      return m_frame.gradient(
          {c * g.x - s * g.y, s * g.x + c * g.y, g.z + rate * (origin.y * g.x - origin.x * g.y)});
    }
    case Kind::taper: {
      const double scale = 1 + (m_amount - 1) * share, rate = changes ? (m_amount - 1) / span : 0.0;
      return m_frame.gradient(
          {g.x / scale, g.y / scale, g.z - (origin.x * g.x + origin.y * g.y) * rate / scale});
    }
    case Kind::bend: {
      const double k = curvature(), x = 1 - k * local.x, z = k * (local.z - m_from);
      const double angle = arc_angle(x, z);
      if (k == 0 || angle <= 0) return m_frame.gradient(g);
      if (angle >= m_amount) {
        const double c = std::cos(m_amount), s = std::sin(m_amount);
        return m_frame.gradient({c * g.x + s * g.z, g.y, c * g.z - s * g.x});
      }
      const double square = x * x + z * z, radius = std::sqrt(square);
      return m_frame.gradient(
          {x / radius * g.x + z / square * g.z, g.y, x / square * g.z - z / radius * g.x});
    }
  }
  return {};
}

Box3d Deformation::origins(const Box3d& box, double u) const {
  const Vec3d center = box.min * 0.5 + box.max * 0.5, half = (box.max - box.min) * 0.5;
  const Vec3d middle = m_frame.local_point(center);
  Vec3d extent;
  for (int k = 0; k < 3; ++k) {
    const Vec3d& row = m_frame.row(k);
    extent[k] = std::fabs(row.x) * half.x + std::fabs(row.y) * half.y + std::fabs(row.z) * half.z;
  }
  const Box3d local(middle - extent, middle + extent);
  // Some 20 roundings on the way, each relative to coordinates, angles to the reach of what they turn.
  const double roundings = 64 * u * (1 + std::fabs(m_amount));
  const double ends = std::fabs(m_from) + std::fabs(m_to);
  const Box3d safe = widened(local, roundings * (reach(local) + ends));
  const Box3d result = local_origins(safe);
  return widened(result, roundings * (reach(result) + ends));
}

Box3d Deformation::local_origins(const Box3d& local) const {
  const double span = m_to - m_from;
  const Interval x = side(local, 0), y = side(local, 1);
  const Interval share = clipped({(local.min.z - m_from) / span, (local.max.z - m_from) / span}, 0.0, 1.0);
  Box3d result = local;
  switch (m_kind) {
    case Kind::twist: {
      // Turned by the middle angle; what is left of the angle moves no point farther than its arc.
      const auto [turned_x, turned_y] = turned(x, y, m_amount * (share.lo + share.hi) / 2);
      const double radius = std::hypot(x.magnitude(), y.magnitude());
      const double arc = std::fabs(m_amount) * share.width() / 2 * radius;
      set_side(result, 0, clipped(turned_x.widened(arc), -radius, radius));
      set_side(result, 1, clipped(turned_y.widened(arc), -radius, radius));
      return result;
    }
    case Kind::taper: {
      const double a = 1 + (m_amount - 1) * share.lo, b = 1 + (m_amount - 1) * share.hi;
      const Interval inverse{1 / std::max(a, b), 1 / std::min(a, b)};
      set_side(result, 0, product(x, inverse));
      set_side(result, 1, product(y, inverse));
      return result;
    }
    case Kind::bend:
      return bent_origins(local);
  }
  return result;
}

Box3d Deformation::bent_origins(const Box3d& local) const {
  const double k = curvature();
  if (k == 0) return local;
  const Interval x{1 - k * local.max.x, 1 - k * local.min.x};
  const Interval z{k * (local.min.z - m_from), k * (local.max.z - m_from)};
  const double cut = m_amount / 2 - std::numbers::pi;

  // The angles under which the rectangle is seen from the arc's centre.
  Interval angles = Interval::everything();
  if (!(x.contains(0) && z.contains(0))) {
    const double middle_x = (x.lo + x.hi) / 2, middle_z = (z.lo + z.hi) / 2;
    const double middle = arc_angle(middle_x, middle_z);
    Interval seen{middle, middle};
    for (const double cx : {x.lo, x.hi}) {
      for (const double cz : {z.lo, z.hi}) {
        const double off = std::atan2(middle_x * cz - middle_z * cx, middle_x * cx + middle_z * cz);
        seen = hull(seen, {middle + off, middle + off});
      }
    }
    seen = seen.widened(8 * kDoubleRoundoff * seen.magnitude());
    const bool meets_cut = seen.lo <= cut || seen.hi >= cut + 2 * std::numbers::pi;
    if (!meets_cut) angles = seen;
  }

  Box3d result;
  if (angles.lo <= 0) result.extendBy(local);
  if (angles.hi >= m_amount) {
    const auto [turned_x, turned_z] = turned(side(local, 0), {z.lo / k, z.hi / k}, -m_amount);
    const double half = std::sin(m_amount / 2), shift_x = 2 * half * half / k,
                 shift_z = m_to - std::sin(m_amount) / k;
    result.extendBy(Vec3d(turned_x.lo + shift_x, local.min.y, turned_z.lo + shift_z));
    result.extendBy(Vec3d(turned_x.hi + shift_x, local.max.y, turned_z.hi + shift_z));
  }
  if (angles.hi > 0 && angles.lo < m_amount) {
    const double farthest = std::hypot(x.magnitude(), z.magnitude());
    const double nearest = std::hypot(x.contains(0) ? 0.0 : std::min(std::fabs(x.lo), std::fabs(x.hi)),
                                      z.contains(0) ? 0.0 : std::min(std::fabs(z.lo), std::fabs(z.hi)));
    const double margin = 16 * kDoubleRoundoff / k;
    const Interval along = clipped(angles, 0.0, m_amount);
    result.extendBy(Vec3d((1 - farthest) / k - margin, local.min.y, m_from + along.lo / k));
    result.extendBy(Vec3d((1 - nearest) / k + margin, local.max.y, m_from + along.hi / k));
  }
  return result;
}

Box3d Deformation::image(const Box3d& origins) const {
  if (origins.isEmpty()) return origins;
  const Box3d local = local_image(origins);
  Box3d box;
  for (int axis = 0; axis < 3; ++axis) {
    Interval sum{m_frame.center()[axis], m_frame.center()[axis]};
    for (int k = 0; k < 3; ++k) {
      const Interval part = product(side(local, k), {m_frame.axis(k)[axis], m_frame.axis(k)[axis]});
      sum = {sum.lo + part.lo, sum.hi + part.hi};
    }
    set_side(box, axis, sum);
  }
  return box;
}

Box3d Deformation::local_image(const Box3d& origins) const {
  const Interval x = side(origins, 0), y = side(origins, 1), z = side(origins, 2);
  Box3d result = origins;
  switch (m_kind) {
    case Kind::twist: {
      const double radius = std::hypot(x.magnitude(), y.magnitude());
      set_side(result, 0, {-radius, radius});
      set_side(result, 1, {-radius, radius});
      return result;
    }
    case Kind::taper: {
      const Interval scale{std::min(1.0, m_amount), std::max(1.0, m_amount)};
      set_side(result, 0, product(x, scale));
      set_side(result, 1, product(y, scale));
      return result;
    }
    case Kind::bend: {
      const double k = curvature(), angle = m_amount;
      if (k == 0) return result;
      const double pi = std::numbers::pi;
      // On the arc: x + r (1 - cos), from + r sin, r = 1/k - x the distance from its centre.
      const Interval r{1 / k - x.hi, 1 / k - x.lo};
      const double versine = 1 - std::cos(std::min(angle, pi));
      const Interval sine{angle > 1.5 * pi ? -1.0 : std::min(0.0, std::sin(angle)),
                          angle > 0.5 * pi ? 1.0 : std::sin(angle)};
      const Interval bulge = product(r, {0.0, versine}), along = product(r, sine);
      Interval all_x{x.lo + bulge.lo, x.hi + bulge.hi};
      Interval all_z{m_from + along.lo, m_from + along.hi};
      if (z.lo < m_from) {
        all_x = hull(all_x, x);
        all_z = hull(all_z, z);
      }
      if (z.hi > m_to) {
        const Interval beyond{0.0, z.hi - m_to};
        const auto [turned_x, turned_z] = turned(x, beyond, angle);
        const double c = std::cos(angle), s = std::sin(angle);
        all_x = hull(all_x, {turned_x.lo + (1 - c) / k, turned_x.hi + (1 - c) / k});
        all_z = hull(all_z, {turned_z.lo + m_from + s / k, turned_z.hi + m_from + s / k});
      }
      set_side(result, 0, all_x);
      set_side(result, 2, all_z);
      return result;
    }
  }
  return result;
}

}  // namespace pileus
