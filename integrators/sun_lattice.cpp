#include "integrators/sun_lattice.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "lib/core/error.h"
#include "lib/core/parallel.h"
#include "lib/math/trilinear.h"

namespace pileus {
namespace {

constexpr int kCells = SunLattice::kBrickCells;

/// Where lines stand as far apart as this [cells], means of 2^3 values are summed: they are an eleventh of
/// the memory, and better for what lies between lines than what happens to lie on them. Nearer lines would
/// see details that means have lost: their errors would be half as large again.
constexpr double kHalvedFrom = SunProbe::kCoarsest;

/// The frame of a lattice in the grid's local space.
struct Frame {
  SunSweep sweep;
  double bricks[3] = {0.0, 0.0, 0.0};  ///< along u, v, w; as many as asked for, however many
};

Frame frame_of(const MarchGrid& grid, const Vec3d& wi_world, const LatticeOptions& options) {
  const Vec3d towards = grid.local_from_world.direction(wi_world);
  const auto [across, along] = options.spacing;
  int axis = 0;
  for (int k = 1; k < 3; ++k) {
    if (std::abs(towards[k]) > std::abs(towards[axis])) axis = k;
  }
  Frame frame;
  SunSweep& sweep = frame.sweep;
  sweep.grid = &grid;
  sweep.ew = towards * (along / std::abs(towards[axis]));
  sweep.length = along / std::abs(towards[axis]);
  sweep.steps = std::max(1, int(length(sweep.ew) / across + 0.5));
  sweep.enough = std::min(options.enough, SunLattice::kDeepest);
  sweep.is_everywhere = options.is_everywhere;
  const auto bricks = [](double cells) { return std::ceil(cells / kCells); };
  sweep.is_halved = grid.pyramid->quantized() && across >= kHalvedFrom;
  // Means reach up to two cells further than values.
  const Vec3d margin(sweep.is_halved ? 2.0 : 0.0);
  const Box3d box(grid.bounds.min - margin, grid.bounds.max + margin);
  const double slices = std::max(1.0, std::ceil((box.max[axis] - box.min[axis]) / along));
  frame.bricks[2] = bricks(slices + 1.0);
  sweep.origin[axis] = towards[axis] > 0.0 ? box.min[axis] : box.max[axis];
  // Neighbouring lines lie where the grid's values are neighbours.
  sweep.lane_axis = axis == 2 ? 1 : 2;
  const int axes[2] = {3 - axis - sweep.lane_axis, sweep.lane_axis};
  Vec3d* const edges[2] = {&sweep.eu, &sweep.ev};
  for (int i = 0; i < 2; ++i) {
    const int k = axes[i];
    const double shift = slices * sweep.ew[k];  // how far lines move across the box
    const double lo = box.min[k] - std::max(0.0, shift), hi = box.max[k] - std::min(0.0, shift);
    *edges[i] = Vec3d(0.0);
    (*edges[i])[k] = across;
    sweep.origin[k] = lo - across;  // a line of zeros on either side
    frame.bricks[i] = bricks(std::ceil((hi - lo) / across) + 2.0);
  }
  return frame;
}

double table_size(const Frame& frame) {
  return frame.bricks[0] * frame.bricks[1] * frame.bricks[2];
}

/// The value of a node (SunLattice).
float decode_node(uint16_t node) {
  const int32_t bits = (int32_t(node) << SunLattice::kMantissaShift) + SunLattice::kExponentBias;
  return std::bit_cast<float>(bits) - SunLattice::kOffset;
}

uint16_t encode_node(float tau) {
  constexpr int32_t kHalf = 1 << (SunLattice::kMantissaShift - 1);
  const int32_t bits = std::bit_cast<int32_t>(tau + SunLattice::kOffset) + kHalf - SunLattice::kExponentBias;
  return uint16_t(bits >> SunLattice::kMantissaShift);
}

/// A cell of a lattice, and a position in it.
struct PlaceInCell {
  Vec3i cell;
  Vec3d p;
};

/// Positions beyond the lattice count as its border.
PlaceInCell place_in(const Vec3i& cells, const Vec3d& p) {
  PlaceInCell place;
  for (int axis = 0; axis < 3; ++axis) {
    const double inside = std::clamp(p[axis], 0.0, double(cells[axis]));
    place.cell[axis] = std::min(int(inside), cells[axis] - 1);
    place.p[axis] = inside - place.cell[axis];
  }
  return place;
}

}  // namespace

Affine lattice_from_local(const Vec3d& o, const Vec3d& u, const Vec3d& v, const Vec3d& w) {
  return Affine(Imath::M44d(u.x, u.y, u.z, 0, v.x, v.y, v.z, 0, w.x, w.y, w.z, 0, o.x, o.y, o.z, 1))
      .inverse();
}

double bricks_with_density(const MarchGrid& grid, const LatticeOptions& options) {
  const auto& ranges = grid.pyramid->levels().front().ranges;
  const double filled =
      double(std::count_if(ranges.begin(), ranges.end(), [](const ValueRange& r) { return r.hi > 0.0f; }));
  const double scale[3] = {1.0 / options.spacing.across, 1.0 / options.spacing.across,
                           1.0 / options.spacing.along};
  const double edge = std::cbrt(filled);
  double bricks = 1.0;
  for (const double s : scale) bricks *= edge * s + 1.0;
  return filled > 0.0 ? bricks : 0.0;
}

double sun_lattice_bytes(const MarchGrid& grid, const Vec3d& wi_world, const LatticeOptions& options) {
  const double table = table_size(frame_of(grid, wi_world, options));
  const double bricks = options.is_everywhere ? table : std::min(table, bricks_with_density(grid, options));
  return table * sizeof(int32_t) + bricks * brick_bytes();
}

SunLattice build_sun_lattice(const MarchGrid& grid, const Vec3d& wi_world, const LatticeOptions& options,
                             uint64_t* samples) {
  const Frame frame = frame_of(grid, wi_world, options);
  const SunSweep& sweep = frame.sweep;
  return fill_lattice(
      lattice_from_local(sweep.origin, sweep.eu, sweep.ev, sweep.ew) * grid.local_from_world, frame.bricks,
      sweep.enough, options.most_bytes,
      [&](const Vec2i& first, const Vec2i& end, SunBricks& bricks) {
        sweep_sun_bricks(sweep, first, end, bricks);
      },
      samples);
}

SunLattice fill_lattice(const Affine& lattice_from_world, const double (&count)[3], float enough,
                        double most_bytes, const SweepBricks& sweep, uint64_t* samples) {
  constexpr int64_t kShared = 2, kMost = (int64_t(1) << 30) / SunLattice::kPitch;
  const double table = count[0] * count[1] * count[2];
  SunLattice lattice;
  lattice.lattice_from_world = lattice_from_world;
  const double room = (most_bytes - table * sizeof(int32_t)) / brick_bytes();
  if (!(room >= double(kShared))) return lattice;
  lattice.bricks = Vec3i(int(count[0]), int(count[1]), int(count[2]));
  SunBricks bricks;
  bricks.lattice = &lattice;
  bricks.next = kShared;
  bricks.most = std::min({int64_t(room), int64_t(table) + kShared, kMost});
  lattice.offsets.resize(size_t(table));
  lattice.nodes = make_large_array<uint16_t>(size_t(bricks.most) * SunLattice::kPitch);
  std::fill_n(lattice.nodes.get(), SunLattice::kPitch, encode_node(0.0f));
  std::fill_n(lattice.nodes.get() + SunLattice::kPitch, SunLattice::kPitch, encode_node(enough));
  constexpr int kColumnsU = 2, kColumnsV = 7;  // bricks of a task; with the lines beside, 19 by 59 lines
  const int tasks_u = (lattice.bricks.x + kColumnsU - 1) / kColumnsU,
            tasks_v = (lattice.bricks.y + kColumnsV - 1) / kColumnsV;
  parallel_for(size_t(tasks_u) * size_t(tasks_v), [&](size_t task) {
    const Vec2i first(int(task) / tasks_v * kColumnsU, int(task) % tasks_v * kColumnsV);
    const Vec2i end(std::min(first.x + kColumnsU, lattice.bricks.x),
                    std::min(first.y + kColumnsV, lattice.bricks.y));
    sweep(first, end, bricks);
  });
  if (samples) *samples += bricks.samples;
  lattice.used = bricks.next;
  if (lattice.used > bricks.most) return SunLattice();
  return lattice;
}

double sun_depth(const SunLattice& lattice, const Vec3d& p_world) {
  return depth_at(lattice, lattice.lattice_from_world.point(p_world));
}

double depth_at(const SunLattice& lattice, const Vec3d& p_lattice) {
  const auto [cell, p] = place_in(kCells * lattice.bricks, p_lattice);
  const Vec3i brick = cell / kCells, inside = cell - kCells * brick;
  const int32_t offset =
      lattice
          .offsets[(size_t(brick.x) * size_t(lattice.bricks.y) + size_t(brick.y)) * size_t(lattice.bricks.z) +
                   size_t(brick.z)];
  std::array<double, 8> corners;
  for (int n = 0; n < 8; ++n) {
    const int u = inside.x + (n & 1), v = inside.y + (n >> 1 & 1), w = inside.z + (n >> 2);
    const int at = u * SunLattice::kStrideU + v * SunLattice::kStrideV + w * SunLattice::kStrideW;
    corners[size_t(n)] = double(decode_node(lattice.nodes[size_t(offset + at)]));
  }
  return trilinear(corners, p);
}

SunProbe::SunProbe(const MarchGrid& grid, const Vec3d& wi_world, const LatticeOptions& options) {
  PILEUS_CHECK(options.spacing.across < kCoarsest);
  const Frame frame = frame_of(grid, wi_world, options);
  m_sweep = frame.sweep;
  m_lattice_from_world =
      lattice_from_local(m_sweep.origin, m_sweep.eu, m_sweep.ev, m_sweep.ew) * grid.local_from_world;
  m_cells = kCells * Vec3i(int(frame.bricks[0]), int(frame.bricks[1]), int(frame.bricks[2]));
}

double SunProbe::depth(const Vec3d& p_world) const {
  const auto [cell, p] = place_in(m_cells, m_lattice_from_world.point(p_world));
  SunLines lines;
  sum_sun_lines(m_sweep, cell, m_cells.z, lines);
  std::array<double, 8> corners;
  for (int n = 0; n < 8; ++n) {
    const int u = n & 1, v = n >> 1 & 1, w = n >> 2;
    const double tau = lines.at(u, v, w),
                 across = lines.at(u - 1, v, w) + lines.at(u + 1, v, w) + lines.at(u, v - 1, w) +
                          lines.at(u, v + 1, w),
                 along = lines.at(u, v, w - 1) + lines.at(u, v, w + 1);
    const double balanced = tau - (across - 4.0 * tau + along - 2.0 * tau) / 12.0;
    corners[size_t(n)] = std::clamp(balanced, double(SunLattice::kLowest), double(m_sweep.enough));
  }
  return trilinear(corners, p);
}

}  // namespace pileus
