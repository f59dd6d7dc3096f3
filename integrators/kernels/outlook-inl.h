// What lies ahead of a packet of rays.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_OUTLOOK_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_OUTLOOK_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_OUTLOOK_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_OUTLOOK_INL_H
#endif

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "hwy/highway.h"

#include "integrators/kernels/hazes-inl.h"
#include "integrators/kernels/lamps-inl.h"
#include "integrators/kernels/march_kernel.h"
#include "integrators/kernels/places-inl.h"
#include "integrators/kernels/walks-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {

/// What a packet meets on its way, slab by slab, before anything is sampled.
///   kGrids: as of Marcher
template <int kGrids>
class Outlook {
 public:
  static constexpr int kMostLevel = 8;  ///< slabs of 8 << level cells

  /// All outlive it.
  Outlook(const MarchScene& scene, Places& places, Hazes& hazes, Lamps& lamps)
      : m_scene(scene),
        m_places(places),
        m_hazes(hazes),
        m_lamps(lamps),
        m_grids(places.any() ? 0 : scene.grids.size()),
        m_locals(m_grids * kPacketRays) {}

  /// Beams of the packet in every grid, and where on the rays something may be met.
  Segment enter(std::span<const MarchRay> rays) {
    m_beams.clear();
    Segment inside{std::numeric_limits<double>::infinity(), 0.0}, wanted = inside;
    m_finest = std::numeric_limits<double>::infinity();
    if (m_places.any()) inside = m_places.enter(rays, m_finest);
    for (size_t g = 0; g < m_grids; ++g) {
      const MarchGrid& grid = m_scene.grids[g];
      m_beams.emplace_back(grid, grid.local_from_world, rays, std::span(m_locals).subspan(g * kPacketRays));
      const Segment in_grid = m_beams.back().inside();
      inside = {std::min(inside.t0, in_grid.t0), std::max(inside.t1, in_grid.t1)};
      m_finest = std::min(m_finest, m_beams.back().voxel());
    }
    if constexpr (kGrids != 1) enter_hazes(rays, inside);
    leaps = 0;
    latest_start = m_brightest = 0.0;
    earliest_end = std::numeric_limits<double>::infinity();
    for (const MarchRay& job : rays) {
      wanted = {std::min(wanted.t0, job.segment.t0), std::max(wanted.t1, job.segment.t1)};
      latest_start = std::max(latest_start, job.segment.t0);
      earliest_end = std::min(earliest_end, job.segment.t1);
      m_brightest = std::max(m_brightest, job.brightest);
    }
    const Segment way{std::max(inside.t0, wanted.t0), std::min(inside.t1, wanted.t1)};
    if constexpr (kGrids != 1) {
      m_hazes.begin(rays, way.t0);
      m_lamps.enter(rays, way.t0);
    }
    return way;
  }

  /// Where the slab of a level ends that begins at t.
  double slab_end(double t, int level, double last) const {
    double length = double(BrickGrid::kBrickCells << level) * m_finest;
    if constexpr (kGrids != 1) length = std::min(length, m_lamps.reach(t));
    return std::min(t + length, last);
  }

  /// The way without what is empty in front of everything else; empty where all of it is.
  Segment leap_ahead(Segment way) {
    for (int level = 0; way.t0 < way.t1;) {
      const double end = slab_end(way.t0, level, way.t1);
      if (look(way.t0, end).is_empty) {
        ++leaps;
        way.t0 = end > way.t0 ? end : way.t1;
        level = std::min(level + 1, kMostLevel);
      } else if (level-- == 0) {
        return way;
      }
    }
    return {};
  }

  Slab look(double t0, double t1) {
    Slab slab;
    for (size_t g = 0; g < m_beams.size(); ++g) {
      const MarchGrid& grid = m_scene.grids[g];
      ValueRange range = m_beams[g].range(t0, t1);
      if (!m_scene.is_leaping) range = m_beams[g].whole();
      if (range.hi == 0.0f) continue;
      slab.is_empty = false;
      slab.is_uniform &= range.is_uniform();
      slab.sigma += grid.extinction * double(range.hi);
      slab.variation += light_scale(grid) * double(range.hi - range.lo);
      slab.voxel = std::min(slab.voxel, m_beams[g].voxel());
    }
    if constexpr (kGrids != 1) {
      const auto scale = [&](const MarchMedium& medium) { return light_scale(medium); };
      m_places.look_ahead(t0, t1, scale, slab);
      m_hazes.look_ahead(m_scene, t0, t1, scale, slab);
      m_lamps.look_ahead(t0, t1, slab);
    }
    return slab;
  }

  /// A ray of the packet in the space of a grid.
  const Ray& local(size_t grid, size_t ray) const { return m_locals[grid * kPacketRays + ray]; }

  double latest_start = 0.0, earliest_end = 0.0;  ///< of the rays' segments
  uint64_t leaps = 0;                             ///< over slabs in which nothing is met

 private:
  void enter_hazes(std::span<const MarchRay> rays, Segment& inside) {
    if (!m_hazes.any()) return;
    const Segment in_hazes = m_hazes.inside(rays);
    inside = {std::min(inside.t0, in_hazes.t0), std::max(inside.t1, in_hazes.t1)};
    constexpr double kSlabs = 16.0;
    if (m_scene.grids.empty()) m_finest = inside.length() / (kSlabs * double(BrickGrid::kBrickCells));
    // Where a ray ends within little of a slab, slabs have to be as short.
    m_finest = std::min(m_finest, m_hazes.mean_free_path(m_scene, rays));
  }

  /// How much a density adds to a ray, relative to the brightest it can get [1/m]: by its extinction, or by
  /// what it glows.
  double light_scale(const MarchMedium& medium) const {
    if (!(medium.glow > medium.extinction * m_brightest)) return medium.extinction;
    return medium.glow / std::max(m_brightest, 1e-30);
  }

  const MarchScene& m_scene;
  Places& m_places;
  Hazes& m_hazes;
  Lamps& m_lamps;
  size_t m_grids;                 ///< that stand but once; what follows is of these
  std::vector<Ray> m_locals;      ///< [grid][ray]
  std::vector<GridBeam> m_beams;  ///< one per grid
  double m_finest = 0.0;          ///< length in which no ray moves by more than a voxel of any grid [m]
  double m_brightest = 0.0;       ///< no light on any of the rays is brighter
};

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
