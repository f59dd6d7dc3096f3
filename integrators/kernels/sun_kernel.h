#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <limits>
#include <span>

#include "integrators/kernels/sun_nodes.h"
#include "lib/math/ray.h"

namespace pileus {

struct MarchGrid;

// Loops that find out how much light of a sun gets where: sweeps along its direction, and single columns.

/// How a lattice is to be filled.
///   local_at(u, v, w) = origin + u * eu + v * ev + w * ew, local to the grid
struct SunSweep {
  const MarchGrid* grid = nullptr;
  Vec3d origin, eu, ev, ew;
  int lane_axis = 2;          ///< of the grid: ev has no other component, and that is > 0
  double length = 0.0;        ///< of ew in world space [m]
  int steps = 1;              ///< samples between neighbouring nodes
  bool is_halved = false;     ///< means are read (QuantizedValues::means), not the values themselves
  float enough = 0.0f;        ///< depths beyond this count as this
  bool is_everywhere = true;  ///< false: depths are only wanted where the grid has a density
};

/// The same for a lamp: lines meet in it.
///   local_at(u, v, w) = lamp + (w0 + w) * (ahead + u * eu + v * ev), local to the grid
struct LampSweep {
  const MarchGrid* grid = nullptr;
  Vec3d lamp, ahead, eu, ev;
  double w0 = 0.0;
  int steps = 1;              ///< samples between neighbouring nodes
  float enough = 0.0f;        ///< depths beyond this count as this
  bool is_everywhere = true;  ///< false: depths are only wanted where the grid has a density
};

/// Where bricks go.
struct SunBricks {
  SunLattice* lattice = nullptr;
  std::atomic<int64_t> next{0};      ///< the first brick that is free
  int64_t most = 0;                  ///< bricks that there is room for; further ones are counted, not stored
  std::atomic<uint64_t> samples{0};  ///< densities read
};

/// Depths at the nodes around a cell of a lattice: of its own eight, and of what balancing these looks at.
struct SunLines {
  static constexpr size_t kLines = 16, kLevels = 4;

  /// [level][line]: at w - 1 + level
  alignas(64) std::array<std::array<float, kLines>, kLevels> depths;

  /// Where a line is, relative to the cell; line() of u, v is 4 (u + 1) + v + 1.
  static Vec3i line(size_t n) { return {int(n >> 2) - 1, int(n & 3) - 1, 0}; }
  double at(int u, int v, int w) const { return double(depths[size_t(w + 1)][size_t(4 * (u + 1) + v + 1)]); }
};

/// Sums the lines around a cell of a lattice of `top` levels. For sweeps that read values, not means.
void sum_sun_lines(const SunSweep& sweep, const Vec3i& cell, int top, SunLines& lines);

/// Fills the bricks [first, end) of u and v, and all of w.
void sweep_sun_bricks(const SunSweep& sweep, const Vec2i& first, const Vec2i& end, SunBricks& bricks);

void sweep_lamp_bricks(const LampSweep& sweep, const Vec2i& first, const Vec2i& end, SunBricks& bricks);

/// Densities at t0 + i * dt along a local ray that stays inside the table of bricks, or far outside.
void sample_density(const MarchGrid& grid, const Ray& local, double t0, double dt, std::span<float> rho);

/// Integral of the density along a local ray to the end of the grid or of the ray, whichever comes first, by
/// equal steps of dt, in units of t.
///   end: a multiple of dt
double stepped_column(const MarchGrid& grid, const Ray& local, double dt,
                      double end = std::numeric_limits<double>::infinity());

}  // namespace pileus
