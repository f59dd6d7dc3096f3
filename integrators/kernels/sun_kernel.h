#pragma once

#include <atomic>
#include <cstdint>
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

/// Where bricks go.
struct SunBricks {
  SunLattice* lattice = nullptr;
  std::atomic<int64_t> next{0};      ///< the first brick that is free
  int64_t most = 0;                  ///< bricks that there is room for; further ones are counted, not stored
  std::atomic<uint64_t> samples{0};  ///< densities read
};

/// Fills the bricks [first, end) of u and v, and all of w.
void sweep_sun_bricks(const SunSweep& sweep, const Vec2i& first, const Vec2i& end, SunBricks& bricks);

/// Densities at t0 + i * dt along a local ray that stays inside the table of bricks, or far outside.
void sample_density(const MarchGrid& grid, const Ray& local, double t0, double dt, std::span<float> rho);

/// Integral of the density along a local ray to the end of the grid, by equal steps of dt, in units of t.
double stepped_column(const MarchGrid& grid, const Ray& local, double dt);

}  // namespace pileus
