#include "lib/terrain/height_field.h"

#include <array>
#include <cmath>

namespace pileus {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A quadratic on [0, 1] by its Bernstein coefficients.
struct Bernstein {
  double b0, b1, b2;
};

/// Where g passes from > 0 to <= 0 or back, ascending: at least one place if b0 and b2 differ in that, no or
/// two otherwise. Sums have terms of one sign only, so that all roots are in [0, 1] and keep their digits.
struct SignChanges {
  int count = 0;
  std::array<double, 2> s{};
};

SignChanges sign_changes(Bernstein g) {
  const bool above0 = g.b0 > 0.0, above2 = g.b2 > 0.0;
  if (!above0) g = {-g.b0, -g.b1, -g.b2};
  if (above0 != above2) {
    const double root = std::sqrt(g.b1 * g.b1 - g.b0 * g.b2);
    if (g.b1 > 0.0) return {1, {(root + g.b1) / (root + g.b1 - g.b2), 0.0}};
    const double sum = g.b0 + (root - g.b1);
    return {1, {sum > 0.0 ? g.b0 / sum : 0.0, 0.0}};
  }
  if (g.b1 >= 0.0) return {};  // all coefficients on one side: so is the curve
  const double discriminant = g.b1 * g.b1 - g.b0 * g.b2;
  if (!(discriminant > 0.0)) return {};
  const double root = std::sqrt(discriminant);
  return {2, {g.b0 / (g.b0 - g.b1 + root), (root - g.b1) / (root - g.b1 + g.b2)}};
}

/// A ray among the lines of a grid.
class GridRay {
 public:
  explicit GridRay(const Ray& ray) : m_ray(ray) {
    for (int axis = 0; axis < 2; ++axis) {
      m_inverse[size_t(axis)] = 1.0 / ray.d[axis];
      if (!std::isfinite(m_inverse[size_t(axis)])) m_ray.d[axis] = 0.0;  // denormals never reach a line
    }
  }

  /// Where the ray crosses line k of an axis; any cell that the line bounds gets the same number.
  double at_line(int axis, int k) const { return (k - m_ray.o[axis]) * m_inverse[size_t(axis)]; }

  double z(double t) const { return m_ray.o.z + t * m_ray.d.z; }

  /// The coordinate at t within cell k, 0 to 1: exactly 0 or 1 where the ray crosses a line.
  double fraction(int axis, int k, double t) const {
    if (m_ray.d[axis] != 0.0) {
      if (t == at_line(axis, k)) return 0.0;
      if (t == at_line(axis, k + 1)) return 1.0;
    }
    return std::clamp(m_ray.o[axis] + t * m_ray.d[axis] - k, 0.0, 1.0);
  }

  /// The part of a segment between two lines of an axis.
  Segment clip(int axis, Segment segment, int k0, int k1) const {
    if (m_ray.d[axis] == 0.0) {
      const bool is_between = m_ray.o[axis] >= k0 && m_ray.o[axis] <= k1;
      return is_between ? segment : Segment{};
    }
    const double a = at_line(axis, k0), b = at_line(axis, k1);
    return {std::max(segment.t0, std::min(a, b)), std::min(segment.t1, std::max(a, b))};
  }

  /// The part of a segment between two heights.
  Segment clip_heights(Segment segment, double least, double greatest) const {
    const double oz = m_ray.o.z, dz = m_ray.d.z;
    if (dz == 0.0) return oz >= least && oz <= greatest ? segment : Segment{};
    const double a = (least - oz) / dz, b = (greatest - oz) / dz;
    return {std::max(segment.t0, std::min(a, b)), std::min(segment.t1, std::max(a, b))};
  }

  const Ray& ray() const { return m_ray; }

 private:
  Ray m_ray;
  std::array<double, 2> m_inverse{};
};

class Bisection {
 public:
  Bisection(const HeightTable& table, const HeightPyramid& pyramid, const Ray& ray, Segment segment)
      : m_table(table), m_pyramid(pyramid), m_ray(ray), m_segment(segment) {}

  std::optional<HeightHit> first_hit(double lowest) {
    const HeightRange all = m_pyramid.all();
    if (all.empty() || !(lowest <= all.greatest)) return std::nullopt;
    Segment inside = m_ray.clip(0, m_segment, 0, m_table.cells_x());
    inside = m_ray.clip(1, inside, 0, m_table.cells_y());
    if (!(inside.t0 <= inside.t1)) return std::nullopt;
    // Rounding of heights along the ray and of interpolated heights, with room to spare.
    const double far = std::isfinite(inside.t1) ? std::abs(inside.t1 * m_ray.ray().d.z) : 0.0;
    const double highest = std::max(std::abs(double(all.least)), std::abs(double(all.greatest)));
    m_margin = 16.0 * std::numeric_limits<double>::epsilon() * (std::abs(m_ray.ray().o.z) + far + highest);
    inside = m_ray.clip_heights(inside, std::max(lowest, all.least - m_margin), all.greatest + m_margin);
    if (!(inside.t0 <= inside.t1) || !std::isfinite(inside.t1)) return std::nullopt;
    visit(m_pyramid.top(), 0, 0, inside.t0, inside.t1);
    return m_hit;
  }

 private:
  bool passes_by(const HeightRange& range, double t0, double t1) const {
    if (range.empty()) return true;
    const double z0 = m_ray.z(t0), z1 = m_ray.z(t1);
    return std::min(z0, z1) > range.greatest + m_margin || std::max(z0, z1) < range.least - m_margin;
  }

  /// True once a hit is found.
  bool visit(int level, int i, int j, double t0, double t1) {
    if (level == 0) return i < m_table.cells_x() && j < m_table.cells_y() && meets_cell(i, j, t0, t1);
    if (i >= m_pyramid.width(level) || j >= m_pyramid.height(level)) return false;
    if (passes_by(m_pyramid.at(level, i, j), t0, t1)) return false;

    const int first[2] = {2 * i, 2 * j};
    int child[2];
    double cut[2];
    for (int axis = 0; axis < 2; ++axis) {
      const int middle = (first[axis] + 1) << (level - 1);
      const double d = m_ray.ray().d[axis];
      cut[axis] = d == 0.0 ? kInfinity : m_ray.at_line(axis, middle);
      const bool is_before = d == 0.0 ? m_ray.ray().o[axis] < middle : (t0 < cut[axis]) == (d > 0.0);
      child[axis] = is_before ? 0 : 1;
      if (!(cut[axis] > t0 && cut[axis] < t1)) cut[axis] = kInfinity;
    }
    while (true) {
      const double next = std::min({cut[0], cut[1], t1});
      if (visit(level - 1, first[0] + child[0], first[1] + child[1], t0, next)) return true;
      if (cut[0] == kInfinity && cut[1] == kInfinity) return false;
      for (int axis = 0; axis < 2; ++axis) {
        if (cut[axis] != next) continue;
        child[axis] = 1 - child[axis];
        cut[axis] = kInfinity;
      }
      t0 = next;
    }
  }

  bool meets_cell(int i, int j, double t0, double t1) {
    const Patch<double> patch = m_table.patch(i, j);
    if (!patch.has_data()) return false;
    const double s0 = m_ray.fraction(0, i, t0), s1 = m_ray.fraction(0, i, t1);
    const double r0 = m_ray.fraction(1, j, t0), r1 = m_ray.fraction(1, j, t1);
    const double z0 = m_ray.z(t0), z1 = m_ray.z(t1);
    // The middle coefficient is the patch's symmetric bilinear form of both ends.
    const double middle = 0.5 * (patch.at(s0, r1) + patch.at(s1, r0));
    const SignChanges roots =
        sign_changes({z0 - patch.at(s0, r0), 0.5 * (z0 + z1) - middle, z1 - patch.at(s1, r1)});
    for (int k = 0; k < roots.count; ++k) {
      const double s = roots.s[size_t(k)], t = std::clamp(lerp(t0, t1, s), t0, t1);
      if (!(t > m_segment.t0 && t < m_segment.t1)) continue;
      const double a = lerp(s0, s1, s), b = lerp(r0, r1, s);
      m_hit = HeightHit{t,
                        i + a,
                        j + b,
                        patch.at(a, b),
                        lerp(patch.z10 - patch.z00, patch.z11 - patch.z01, b),
                        lerp(patch.z01 - patch.z00, patch.z11 - patch.z10, a)};
      return true;
    }
    return false;
  }

  const HeightTable& m_table;
  const HeightPyramid& m_pyramid;
  GridRay m_ray;
  Segment m_segment;
  double m_margin = 0.0;
  std::optional<HeightHit> m_hit;
};

}  // namespace

double HeightField::height(double u, double v) const {
  const MapCell<double> i = map_cell(u, m_table.cells_x()), j = map_cell(v, m_table.cells_y());
  return m_table.patch(i.cell, j.cell).at(i.fraction, j.fraction);
}

std::optional<HeightHit> HeightField::intersect(const Ray& ray, Segment segment, double lowest) const {
  return Bisection(m_table, m_pyramid, ray, segment).first_hit(lowest);
}

}  // namespace pileus
