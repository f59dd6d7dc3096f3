#include "lib/terrain/height_field.h"

#include <array>
#include <bit>
#include <cmath>

#include "lib/terrain/cubic_patch.h"
#include "lib/terrain/grid_ray.h"
#include "lib/terrain/sign_changes.h"

namespace pileus {
namespace {

constexpr int kUnit = CoarsePatches::kUnit, kCoarsest = CoarsePatches::kCoarsest;

/// The surface as walks see it.
struct Ground {
  const HeightTable& table;
  const HeightPyramid& pyramid;
  const CoarsePatches& coarse;
  bool is_cubic;
};

/// One ray's way through the pyramid: a block after the other, along the ray, each as large as the ray lets
/// it be. After a block that the ray passes by comes the one behind it, of twice the size where that begins
/// there; a block that the ray may meet is entered where the ray is, down to the finest that count: cells, or
/// larger patches as the unit says where the ray comes into it, wherever the walk began.
///   is_coarse: larger blocks than a cell may be patches
template <bool is_coarse>
class Walk {
 public:
  Walk(const Ground& ground, const Ray& ray, Segment segment, const HeightSight& sight)
      : m_table(ground.table),
        m_pyramid(ground.pyramid),
        m_coarse(ground.coarse),
        m_is_cubic(ground.is_cubic),
        m_ray(ray),
        m_segment(segment),
        m_sight(sight) {}

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
    if (!(inside.t0 <= inside.t1) || !std::isfinite(inside.t1) || inside.t1 < m_sight.clear)
      return std::nullopt;
    start(inside);
    return walk();
  }

 private:
  /// Enters the block that the ray is in where it may meet something first. Where it starts on the ground
  /// that is a small one: it would be entered down to the cells anyway. Blocks begin where they would begin
  /// had the ray been followed from its start.
  void start(Segment inside) {
    const double t = std::max(inside.t0, m_sight.clear);
    m_level = std::min(first_level(inside, t), m_pyramid.top());
    m_end = inside.t1;
    const int cells[2] = {m_table.cells_x(), m_table.cells_y()};
    for (int axis = 0; axis < 2; ++axis) {
      int cell = int(std::clamp(m_ray.ray().o[axis] + t * m_ray.ray().d[axis], 0.0, double(cells[axis] - 1)));
      while (cell > 0 && !m_ray.is_above_line(axis, cell, t)) --cell;
      while (cell + 1 < cells[axis] && m_ray.is_above_line(axis, cell + 1, t)) ++cell;
      m_block[axis] = cell;
    }
    if constexpr (is_coarse) m_finest = finest_at_start(inside.t0, t);
    m_level = std::max(m_level, m_finest);
    m_t0 = start_of_block(m_level, inside.t0);
    m_block[0] >>= m_level, m_block[1] >>= m_level;
    m_z0 = m_ray.z(m_t0);
  }

  /// The level of the patches that count in the present cell, as each block says where the ray comes into it:
  /// not before t0, and before t, where more is allowed.
  int finest_at_start(double t0, double t) const {
    const CoarsePatches::Allowance most = allowed(t);
    const auto counts = [&](CoarsePatches::Allowance here, int level) {
      return m_coarse.counts(here, level, m_block[0] >> level, m_block[1] >> level);
    };
    for (int level = std::min(kCoarsest, m_pyramid.top()); level > kUnit; --level) {
      if (counts(most, level) && counts(allowed(start_of_block(level, t0)), level)) return level;
    }
    const int i = m_block[0] >> kUnit, j = m_block[1] >> kUnit;
    if (m_coarse.level_of_unit(most, i, j) == 0) return 0;
    return std::min(m_coarse.level_of_unit(allowed(start_of_block(kUnit, t0)), i, j), m_pyramid.top());
  }

  /// Where the ray comes into the block of a level that holds the present cell, not before t.
  double start_of_block(int level, double t) const {
    for (int axis = 0; axis < 2; ++axis) {
      const int behind = ((m_block[axis] >> level) + 1 - m_ray.ahead(axis)) << level;
      if (m_ray.ray().d[axis] != 0.0) t = std::max(t, m_ray.at_line(axis, behind));
    }
    return t;
  }

  /// Blocks behind a clear way are as large as the beam of rays was wide to which it was clear, a few pixels.
  int first_level(Segment inside, double t) const {
    constexpr int kOnGround = 0, kBeam = is_coarse ? 3 : 2, kMost = 30;
    if (t == inside.t0 && inside.t0 != m_segment.t0) return m_pyramid.top();
    if (t == inside.t0) return kOnGround;
    return kBeam + std::clamp(std::ilogb(m_sight.spacing + t * m_sight.spreading), 0, kMost);
  }

  std::optional<HeightHit> walk() {
    while (true) {
      const double leaves[2] = {end_of_block(0), end_of_block(1)};
      const double t1 = std::min({leaves[0], leaves[1], m_end});
      const double z1 = m_ray.z(t1);
      if (m_level == m_finest) {
        if (meets_patch(t1, z1)) return m_hit;
      } else if (t1 >= m_sight.clear && !passes_by(z1)) {
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

  /// True where the ray stays on one side of the block: on that of the last, if it was on any. From one side
  /// to the other it comes through a hole or a gap, and the patches there have to tell.
  bool passes_by(double z1) {
    if (m_side >= 0) {
      const double greatest = m_pyramid.greatest(m_level, m_block[0], m_block[1]);
      if (std::min(m_z0, z1) > greatest + m_margin) {
        m_side = int(std::isfinite(greatest));  // no surface: no side
        return true;
      }
    }
    if (m_side > 0) return false;
    const double least = m_pyramid.least(m_level, m_block[0], m_block[1]);
    if (!(std::max(m_z0, z1) < least - m_margin)) return false;
    m_side = -int(std::isfinite(least));
    return true;
  }

  /// What deviations are allowed in blocks that the ray comes into at t.
  CoarsePatches::Allowance allowed(double t) const {
    return CoarsePatches::allowance(m_sight.coarseness + t * m_sight.coarsening);
  }

  /// Where the ray comes into blocks, up to a level: whether one of them counts as a patch, or else which
  /// level of patches its part does. A smaller block than those that count gives way to one of them.
  void look_at_blocks(int largest) {
    const CoarsePatches::Allowance here = allowed(m_t0);
    for (int level = std::min(largest, m_pyramid.top()); level > kUnit && level >= m_level; --level) {
      const int up = level - m_level;
      if (m_coarse.counts(here, level, m_block[0] >> up, m_block[1] >> up)) return see_patches(level);
    }
    if (m_level > kUnit) return see_patches(0);
    const int up = kUnit - m_level;
    see_patches(m_coarse.level_of_unit(here, m_block[0] >> up, m_block[1] >> up));
  }

  void see_patches(int level) {
    m_finest = std::min(level, m_pyramid.top());
    const int up = std::max(0, m_finest - m_level);
    m_level += up;
    m_block[0] >>= up, m_block[1] >>= up;
  }

  /// Goes on to the part of the block in which the ray is; false where that lies beyond the map.
  bool enter() {
    --m_level;
    for (int axis = 0; axis < 2; ++axis) {
      const int first = 2 * m_block[axis];
      m_block[axis] = first + int(m_ray.is_above_line(axis, (first + 1) << m_level, m_t0));
    }
    if (!is_on_map()) return false;
    if (is_coarse && m_level >= kUnit && m_level <= kCoarsest) look_at_blocks(m_level);
    return true;
  }

  /// Goes on to the block behind; false where the map ends.
  bool step_on(bool along_x, bool along_y) {
    // Without branches: which way a ray turns cannot be foreseen.
    const int i = m_block[0] + int(along_x) * (2 * m_ray.ahead(0) - 1),
              j = m_block[1] + int(along_y) * (2 * m_ray.ahead(1) - 1);
    const int changed = (i ^ m_block[0]) | (j ^ m_block[1]);
    const int up = int(changed > 1) & int(m_level < m_pyramid.top());
    const int crossed = changed << m_level;  // a line of every level up to that of its highest bit
    m_level += up;
    m_block[0] = i >> up, m_block[1] = j >> up;
    if (i < 0 || j < 0 || !is_on_map()) return false;
    if (is_coarse && m_level <= kCoarsest && crossed >> kUnit != 0)
      look_at_blocks(std::min(kCoarsest, int(std::bit_width(unsigned(crossed))) - 1));
    return true;
  }

  bool is_on_map() const {
    if (m_level == 0) return m_block[0] < m_table.cells_x() && m_block[1] < m_table.cells_y();
    return m_block[0] < m_pyramid.width(m_level) && m_block[1] < m_pyramid.height(m_level);
  }

  /// A piece of the ray over the present block, which counts as one patch.
  struct Piece {
    int u0, v0, u1, v1;     ///< lines that bound the block
    double s0, r0, s1, r1;  ///< where the ray is between them, 0 to 1
    double t1, z1;          ///< where it ends; it starts at m_t0, m_z0
  };

  bool meets_patch(double t1, double z1) {
    const Patch<double> patch = m_level == 0 ? m_table.patch(m_block[0], m_block[1])
                                             : m_coarse.patch(m_level, m_block[0], m_block[1]);
    if (!patch.has_data()) {
      m_side = 0;
      return false;
    }
    const bool is_cubic = m_is_cubic && m_level == 0;
    const double greatest = std::max(std::max(patch.z00, patch.z10), std::max(patch.z01, patch.z11));
    if (!is_cubic && m_side >= 0 && std::min(m_z0, z1) > greatest + m_margin) {
      m_side = 1;
      return false;
    }
    const int u0 = m_block[0] << m_level, v0 = m_block[1] << m_level;
    const int u1 = std::min((m_block[0] + 1) << m_level, m_table.cells_x()),
              v1 = std::min((m_block[1] + 1) << m_level, m_table.cells_y());
    const Piece piece{u0,
                      v0,
                      u1,
                      v1,
                      m_ray.fraction(0, u0, u1, m_t0),
                      m_ray.fraction(1, v0, v1, m_t0),
                      m_ray.fraction(0, u0, u1, t1),
                      m_ray.fraction(1, v0, v1, t1),
                      t1,
                      z1};
    return is_cubic ? meets(piece, CubicPatch(m_table, u0, v0)) : meets(piece, patch);
  }

  bool meets(const Piece& piece, const Patch<double>& patch) {
    // The middle coefficient is the patch's symmetric bilinear form of both ends.
    const double middle = 0.5 * (patch.at(piece.s0, piece.r1) + patch.at(piece.s1, piece.r0));
    const double ends[2] = {m_z0 - patch.at(piece.s0, piece.r0), piece.z1 - patch.at(piece.s1, piece.r1)};
    const bool has_gap = comes_through_gap(ends[0], ends[1]);
    const SignChanges roots =
        sign_changes(std::array<double, 3>{ends[0], 0.5 * (m_z0 + piece.z1) - middle, ends[1]});
    return takes_first(piece, has_gap, roots, [&](double s, double r, HeightHit& hit) {
      hit.z = patch.at(s, r);
      hit.du = lerp(patch.z10 - patch.z00, patch.z11 - patch.z01, r) / (piece.u1 - piece.u0);
      hit.dv = lerp(patch.z01 - patch.z00, patch.z11 - patch.z10, s) / (piece.v1 - piece.v0);
    });
  }

  bool meets(const Piece& piece, const CubicPatch& patch) {
    const CubicPatch::Control control = patch.control();
    double greatest = control[0][0];
    for (const auto& row : control) greatest = std::max({greatest, row[0], row[1], row[2], row[3]});
    if (m_side >= 0 && std::min(m_z0, piece.z1) > greatest + m_margin) {
      m_side = 1;
      return false;
    }
    std::array<double, 7> g = along_line(control, piece.s0, piece.r0, piece.s1, piece.r1);
    for (size_t k = 1; k < 6; ++k) g[k] = lerp(m_z0, piece.z1, double(k) / 6.0) - g[k];
    g[0] = m_z0 - patch.at(piece.s0, piece.r0);
    g[6] = piece.z1 - patch.at(piece.s1, piece.r1);
    const bool has_gap = comes_through_gap(g[0], g[6]);
    return takes_first(piece, has_gap, sign_changes(g), [&](double s, double r, HeightHit& hit) {
      hit.z = patch.at(s, r);
      const auto slope = patch.slope(s, r);
      hit.du = slope[0], hit.dv = slope[1];
    });
  }

  /// True where the ray was on the other side of the patch before: two patches that do not meet, seen
  /// coarsely.
  bool comes_through_gap(double start, double end) {
    const bool has_gap = is_coarse && m_side != 0 && (start > 0.0) != (m_side > 0);
    m_side = end > 0.0 ? 1 : -1;
    return has_gap;
  }

  template <class FillIn>
  bool takes_first(const Piece& piece, bool has_gap, const SignChanges& roots, FillIn&& fill_in) {
    for (int k = has_gap ? -1 : 0; k < roots.count; ++k) {
      const double at = k < 0 ? 0.0 : roots.s[size_t(k)],
                   t = std::clamp(lerp(m_t0, piece.t1, at), m_t0, piece.t1);
      if (!(t > m_segment.t0 && t < m_segment.t1)) continue;
      const double s = lerp(piece.s0, piece.s1, at), r = lerp(piece.r0, piece.r1, at);
      m_hit.emplace();
      m_hit->t = t;
      m_hit->u = piece.u0 + s * (piece.u1 - piece.u0), m_hit->v = piece.v0 + r * (piece.v1 - piece.v0);
      if constexpr (is_coarse) m_hit->deviation = m_sight.coarseness + t * m_sight.coarsening;
      fill_in(s, r, *m_hit);
      return true;
    }
    return false;
  }

  const HeightTable& m_table;
  const HeightPyramid& m_pyramid;
  const CoarsePatches& m_coarse;
  bool m_is_cubic;
  GridRay m_ray;
  Segment m_segment;
  HeightSight m_sight;
  double m_margin = 0.0;
  int m_level = 0, m_block[2] = {0, 0};  ///< where the ray is
  int m_finest = 0;                      ///< level of the patches that count there; of the last unit, outside
  double m_t0 = 0.0, m_z0 = 0.0;         ///< where it comes into the block
  double m_end = 0.0;                    ///< where it leaves the map, or its last possible height
  int m_side = 0;                        ///< of the last patch at its end: 1 above, -1 below, 0 unknown
  std::optional<HeightHit> m_hit;
};

}  // namespace

double HeightField::height(double u, double v) const {
  const MapCell<double> i = map_cell(u, m_table.cells_x()), j = map_cell(v, m_table.cells_y());
  if (m_interpolation == HeightInterpolation::bilinear)
    return m_table.patch(i.cell, j.cell).at(i.fraction, j.fraction);
  const CubicPatch patch(m_table, i.cell, j.cell);
  return patch.has_data() ? patch.at(i.fraction, j.fraction) : std::numeric_limits<double>::quiet_NaN();
}

double HeightField::clear_distance(const Beam& beam, const HeightSight& sight) const {
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
  const double highest = std::max(std::abs(double(all.least)), std::abs(double(all.greatest)));
  const double margin = kRounding * (std::max(std::abs(beam.o.min.z), std::abs(beam.o.max.z)) + highest);
  double t = inside.t0, step = 0.25 * (std::min(inside.t1, 1e300) - t);
  while (t < inside.t1) {
    const Box3d box = beam.box(t, t + step);
    const HeightRange ground = m_pyramid.between(box.min.x, box.min.y, box.max.x, box.max.y);
    // What counts as a patch is higher by as much as is allowed, at most.
    const double higher = m_is_coarsened ? sight.coarseness + (t + step) * sight.coarsening : 0.0;
    if (ground.empty() || box.min.z > ground.greatest + higher + margin) {
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
                                                const HeightSight& sight) const {
  const Ground ground{m_table, m_pyramid, m_coarse, m_interpolation == HeightInterpolation::bicubic};
  const bool may_be_coarse = m_is_coarsened && (sight.coarseness > 0.0 || sight.coarsening > 0.0);
  return may_be_coarse ? Walk<true>(ground, ray, segment, sight).first_hit(lowest)
                       : Walk<false>(ground, ray, segment, sight).first_hit(lowest);
}

}  // namespace pileus
