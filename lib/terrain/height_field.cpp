#include "lib/terrain/height_field.h"

#include <array>
#include <cmath>

#include "lib/terrain/grid_ray.h"

namespace pileus {
namespace {

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

/// One ray's way through the pyramid: a block after the other, along the ray, each as large as the ray lets
/// it be. After a block that the ray passes by comes the one behind it, of twice the size where that begins
/// there; a block that the ray may meet is entered where the ray is.
class Walk {
 public:
  Walk(const HeightTable& table, const HeightPyramid& pyramid, const Ray& ray, Segment segment, double clear)
      : m_table(table), m_pyramid(pyramid), m_ray(ray), m_segment(segment), m_clear(clear) {}

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
    if (!(inside.t0 <= inside.t1) || !std::isfinite(inside.t1) || inside.t1 < m_clear) return std::nullopt;
    start(inside);
    return walk();
  }

 private:
  /// Enters the block that the ray is in where it may meet something first. Where it starts on the ground
  /// that is a small one: it would be entered down to the cells anyway. Blocks begin where they would begin
  /// had the ray been followed from its start.
  void start(Segment inside) {
    constexpr int kLow = 3;
    const double t = std::max(inside.t0, m_clear);
    const bool is_near = t > inside.t0 || inside.t0 == m_segment.t0;
    m_level = is_near ? std::min(kLow, m_pyramid.top()) : m_pyramid.top();
    m_t0 = inside.t0, m_end = inside.t1;
    const int cells[2] = {m_table.cells_x(), m_table.cells_y()};
    for (int axis = 0; axis < 2; ++axis) {
      const double d = m_ray.ray().d[axis], at = m_ray.ray().o[axis] + t * d;
      int cell = int(std::clamp(at, 0.0, double(cells[axis] - 1)));
      while (cell > 0 && !m_ray.is_above_line(axis, cell, t)) --cell;
      while (cell + 1 < cells[axis] && m_ray.is_above_line(axis, cell + 1, t)) ++cell;
      m_block[axis] = cell >> m_level;
      const int behind = (m_block[axis] + 1 - m_ray.ahead(axis)) << m_level;
      if (d != 0.0) m_t0 = std::max(m_t0, m_ray.at_line(axis, behind));
    }
    m_z0 = m_ray.z(m_t0);
  }

  std::optional<HeightHit> walk() {
    while (true) {
      const double leaves[2] = {end_of_block(0), end_of_block(1)};
      const double t1 = std::min({leaves[0], leaves[1], m_end});
      const double z1 = m_ray.z(t1);
      if (m_level == 0) {
        if (meets_cell(t1, z1)) return m_hit;
      } else if (t1 >= m_clear && !passes_by(m_pyramid.at(m_level, m_block[0], m_block[1]), z1)) {
        if (!enter()) return std::nullopt;
        continue;
      }
      if (t1 >= m_end) return std::nullopt;
      m_t0 = t1, m_z0 = z1;
      if (!step_on(leaves[0] == t1, leaves[1] == t1)) return std::nullopt;
    }
  }

  double end_of_block(int axis) const {
    return m_ray.at_line(axis, (m_block[axis] + m_ray.ahead(axis)) << m_level);
  }

  bool passes_by(const HeightRange& range, double z1) const {
    return std::min(m_z0, z1) > range.greatest + m_margin || std::max(m_z0, z1) < range.least - m_margin ||
           range.empty();
  }

  /// Goes on to the part of the block in which the ray is; false where that lies beyond the map.
  bool enter() {
    --m_level;
    for (int axis = 0; axis < 2; ++axis) {
      const int first = 2 * m_block[axis];
      m_block[axis] = first + int(m_ray.is_above_line(axis, (first + 1) << m_level, m_t0));
    }
    return is_on_map();
  }

  /// Goes on to the block behind; false where the map ends.
  bool step_on(bool along_x, bool along_y) {
    // Without branches: which way a ray turns cannot be foreseen.
    const int i = m_block[0] + int(along_x) * (2 * m_ray.ahead(0) - 1),
              j = m_block[1] + int(along_y) * (2 * m_ray.ahead(1) - 1);
    const int up = int(((i ^ m_block[0]) | (j ^ m_block[1])) > 1) & int(m_level < m_pyramid.top());
    m_level += up;
    m_block[0] = i >> up, m_block[1] = j >> up;
    return i >= 0 && j >= 0 && is_on_map();
  }

  bool is_on_map() const {
    if (m_level == 0) return m_block[0] < m_table.cells_x() && m_block[1] < m_table.cells_y();
    return m_block[0] < m_pyramid.width(m_level) && m_block[1] < m_pyramid.height(m_level);
  }

  bool meets_cell(double t1, double z1) {
    const int i = m_block[0], j = m_block[1];
    const Patch<double> patch = m_table.patch(i, j);
    const double greatest = std::max(std::max(patch.z00, patch.z10), std::max(patch.z01, patch.z11));
    const double t0 = m_t0, z0 = m_z0;
    if (std::min(z0, z1) > greatest + m_margin || !patch.has_data()) return false;
    const double s0 = m_ray.fraction(0, i, i + 1, t0), s1 = m_ray.fraction(0, i, i + 1, t1);
    const double r0 = m_ray.fraction(1, j, j + 1, t0), r1 = m_ray.fraction(1, j, j + 1, t1);
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
  double m_clear;
  double m_margin = 0.0;
  int m_level = 0, m_block[2] = {0, 0};  ///< where the ray is
  double m_t0 = 0.0, m_z0 = 0.0;         ///< where it comes into the block
  double m_end = 0.0;                    ///< where it leaves the map, or its last possible height
  std::optional<HeightHit> m_hit;
};

}  // namespace

double HeightField::height(double u, double v) const {
  const MapCell<double> i = map_cell(u, m_table.cells_x()), j = map_cell(v, m_table.cells_y());
  return m_table.patch(i.cell, j.cell).at(i.fraction, j.fraction);
}

double HeightField::clear_distance(const Beam& beam) const {
  constexpr double kNever = std::numeric_limits<double>::infinity(), kRounding = 1e-9;
  const HeightRange all = range();
  if (all.empty()) return kNever;
  const Box3d bounds(Vec3d(0.0, 0.0, all.least), Vec3d(m_table.cells_x(), m_table.cells_y(), all.greatest));
  const Segment inside = beam.inside(bounds);
  if (inside.empty()) return kNever;
  // Stretches twice as long where the last was clear, half as long where one was not, until the beam is wider
  // than a stretch is long: then some ray may meet something.
  const double speed = std::max({std::abs(beam.d.min.x), std::abs(beam.d.max.x), std::abs(beam.d.min.y),
                                 std::abs(beam.d.max.y), 1e-300});
  double t = inside.t0, step = 0.25 * (std::min(inside.t1, 1e300) - t);
  while (t < inside.t1) {
    const Box3d box = beam.box(t, t + step);
    const HeightRange ground = m_pyramid.between(box.min.x, box.min.y, box.max.x, box.max.y);
    if (ground.empty() || box.min.z > ground.greatest) {
      t += step, step *= 2.0;
      continue;
    }
    step *= 0.5;
    const Vec3d across = beam.box(t, t).size();
    if (!(step * speed > std::max({0.5 * across.x, 0.5 * across.y, 1.0}))) return t * (1.0 - kRounding);
  }
  return kNever;
}

std::optional<HeightHit> HeightField::intersect(const Ray& ray, Segment segment, double lowest,
                                                double clear) const {
  return Walk(m_table, m_pyramid, ray, segment, clear).first_hit(lowest);
}

}  // namespace pileus
