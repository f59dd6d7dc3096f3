// Grids that stand in many places, on the rays of a packet.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_PLACES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_PLACES_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_PLACES_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_PLACES_INL_H
#endif

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <unordered_map>
#include <vector>

#include "hwy/highway.h"

#include "integrators/kernels/lattice_reader-inl.h"
#include "integrators/kernels/packet-inl.h"
#include "integrators/kernels/readers-inl.h"
#include "integrators/kernels/shadow_rays-inl.h"
#include "integrators/kernels/walks-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Of all places a packet knows those that its rays may meet, and while it is in some of them, those that may
/// throw their shadows there.
class Places {
 public:
  /// The readers outlive it.
  Places(const MarchScene& scene, std::span<const GridReader> grids, std::span<const LatticeReader> lattices)
      : m_scene(scene), m_grids(grids), m_lattices(lattices), m_shading(size_t(scene.lights)) {}

  /// False where every grid stands but once.
  bool any() const { return !m_scene.places.empty(); }

  /// Finds the places that rays may meet, and where on the rays these are.
  ///   finest: becomes the shortest edge of a voxel there [m]
  Segment enter(std::span<const MarchRay> rays, double& finest) {
    Segment inside{std::numeric_limits<double>::infinity(), 0.0};
    finest = std::numeric_limits<double>::infinity();
    m_beam = {};
    m_met.clear();
    m_beams.clear();
    m_paths_of.clear();
    m_sun_paths.clear();
    std::vector<uint32_t> found;
    for (const MarchRay& job : rays) {
      m_beam.o.extendBy(job.ray.o);
      m_beam.d.extendBy(job.ray.d);
      m_scene.place_index.visit(job.ray, job.segment, [&](size_t place, double&) {
        found.push_back(uint32_t(place));
        return true;
      });
    }
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    m_locals.resize(found.size() * kPacketRays);
    for (const uint32_t number : found) {
      const MarchPlace& place = m_scene.places[number];
      const GridBeam beam(m_scene.grids[place.grid], place.local_from_world, rays,
                          std::span(m_locals).subspan(m_met.size() * kPacketRays, kPacketRays));
      const Segment in_place = beam.inside();
      if (in_place.empty()) continue;
      m_beams.push_back(beam);
      m_met.push_back({number, place.grid, in_place, {}});
      inside = {std::min(inside.t0, in_place.t0), std::max(inside.t1, in_place.t1)};
      finest = std::min(finest, beam.voxel());
    }
    m_rays = rays;
    return inside;
  }

  /// t of the steps counts from `base`.
  void begin(double base) {
    m_base = base;
    for (size_t n = 0; n < m_met.size(); ++n) {
      Met& met = m_met[n];
      met.path.from = float(std::max(met.inside.t0 - base, 0.0));
      for (size_t i = 0; i < kPacketRays; ++i) {
        const Ray& local = m_locals[n * kPacketRays + std::min(i, m_rays.size() - 1)];
        met.path.rays.set(i, local.at(base + double(met.path.from)), local.d);
      }
    }
  }

  /// Adds what stands between t0 and t1; densities are read there from now on.
  ///   light_scale: of a grid, Outlook::light_scale
  template <class LightScale>
  void look_ahead(double t0, double t1, const LightScale& light_scale, Slab& slab) {
    m_here.clear();
    for (size_t n = 0; n < m_met.size(); ++n) {
      const Met& met = m_met[n];
      if (!(met.inside.t0 < t1 && met.inside.t1 > t0)) continue;
      const ValueRange range = m_scene.is_leaping ? m_beams[n].range(t0, t1) : m_beams[n].whole();
      if (range.hi == 0.0f) continue;
      const MarchGrid& grid = m_scene.grids[met.grid];
      slab.is_empty = false;
      slab.is_uniform &= range.is_uniform();
      slab.sigma += grid.extinction * double(range.hi);
      slab.variation += light_scale(grid) * double(range.hi - range.lo);
      slab.voxel = std::min(slab.voxel, m_beams[n].voxel());
      m_here.push_back(uint32_t(n));
    }
  }

  /// Finds what may stand between the suns and what look_ahead() has found.
  void find_shadows(double t0, double t1) {
    if (!any()) return;
    const Box3d box = m_beam.box(t0, t1);
    const Vec3d center = 0.5 * (box.min + box.max), half = 0.5 * (box.max - box.min);
    for (size_t light = 0; light < m_shading.size(); ++light) {
      m_candidates.clear();
      for (const uint32_t n : m_here) {
        const std::span<const uint32_t> of_place = m_scene.shading[light].of(m_met[n].place);
        m_candidates.insert(m_candidates.end(), of_place.begin(), of_place.end());
      }
      std::sort(m_candidates.begin(), m_candidates.end());
      m_candidates.erase(std::unique(m_candidates.begin(), m_candidates.end()), m_candidates.end());
      m_shading[light].clear();
      for (const uint32_t number : m_candidates) {
        if (may_shade(m_scene.places[number], light, center, half))
          m_shading[light].push_back({number, paths_of(number, t0) + light});
      }
    }
  }

  /// Density of a grid, summed over its places.
  HWY_INLINE V density(size_t grid, size_t v, V t) const {
    V sum = hn::Zero(D());
    for (const uint32_t n : m_here) {
      const Met& met = m_met[n];
      if (met.grid != grid) continue;
      sum = hn::Add(sum, m_grids[grid].template read<true>(met.path.at(0, v, t), met.path.at(1, v, t),
                                                           met.path.at(2, v, t)));
    }
    return sum;
  }

  /// Optical depth of all grids towards a sun.
  V depth(int light, size_t v, V t, uint64_t& lookups) const {
    const D d;
    V sum = hn::Zero(d);
    for (const Shading& shading : m_shading[size_t(light)]) {
      const MarchPlace& place = m_scene.places[shading.place];
      const Path& path = m_sun_paths[shading.path];
      const V x = path.at(0, v, t), y = path.at(1, v, t), z = path.at(2, v, t);
      if (m_scene.shadow_step > 0.0) {
        const MarchGrid& grid = m_scene.grids[place.grid];
        const Vec3d towards = place.local_from_world.direction(m_scene.towards_suns[size_t(light)]);
        sum = hn::Add(sum,
                      trace_shadow(grid, m_grids[place.grid],
                                   {towards, m_scene.shadow_step, m_scene.enough_shadow}, x, y, z, lookups));
      } else {
        const LatticeReader& lattice = m_lattices[size_t(light) * m_scene.kinds.size() + place.kind];
        sum = hn::MulAdd(lattice.read(x, y, z), hn::Set(d, float(place.depth_scale)), sum);
      }
    }
    return sum;
  }

 private:
  /// The rays in the space of a grid or of a lattice. Floats count from where they matter: places may stand
  /// many voxels apart.
  struct Path {
    PacketPath rays;
    float from = 0.0f;

    HWY_INLINE V at(int axis, size_t v, V t) const {
      return rays.at(axis, v, hn::Sub(t, hn::Set(D(), from)));
    }
  };

  struct Met {
    uint32_t place;
    size_t grid;
    Segment inside;
    Path path;
  };

  struct Shading {
    uint32_t place;
    size_t path;
  };

  /// Whether a place may stand on the way from a box to a sun: where the box's centre meets bounds that are
  /// larger by its half size.
  bool may_shade(const MarchPlace& place, size_t light, const Vec3d& center, const Vec3d& half) const {
    const Affine& map = place.local_from_world;
    const MarchGrid& grid = m_scene.grids[place.grid];
    if (!(grid.extinction > 0.0)) return false;
    Vec3d grown(0.0);
    for (int axis = 0; axis < 3; ++axis) {
      Vec3d edge(0.0);
      edge[axis] = half[axis];
      const Vec3d local = map.direction(edge);
      for (int k = 0; k < 3; ++k) grown[k] += std::abs(local[k]);
    }
    const Box3d bounds(grid.bounds.min - grown, grid.bounds.max + grown);
    return !clip_to_bounds(bounds, {map.point(center), map.direction(m_scene.towards_suns[light])},
                           {0.0, std::numeric_limits<double>::infinity()})
                .empty();
  }

  /// Where the paths for each light begin among m_sun_paths; made when they are first asked for.
  size_t paths_of(uint32_t number, double t0) {
    const auto [known, is_new] = m_paths_of.try_emplace(number, m_sun_paths.size());
    if (!is_new) return known->second;
    const MarchPlace& place = m_scene.places[number];
    for (size_t light = 0; light < m_shading.size(); ++light) {
      const Affine map =
          m_scene.shadow_step > 0.0
              ? place.local_from_world
              : m_scene.lattices[light * m_scene.kinds.size() + place.kind].lattice_from_world *
                    place.kind_from_world;
      Path& path = m_sun_paths.emplace_back();
      path.from = float(t0 - m_base);
      for (size_t i = 0; i < kPacketRays; ++i) {
        const Ray& ray = m_rays[std::min(i, m_rays.size() - 1)].ray;
        path.rays.set(i, map.point(ray.at(m_base + double(path.from))), map.direction(ray.d));
      }
    }
    return known->second;
  }

  const MarchScene& m_scene;
  std::span<const GridReader> m_grids;
  std::span<const LatticeReader> m_lattices;  ///< [light][kind]

  // The present packet.
  std::span<const MarchRay> m_rays;
  Beam m_beam;  ///< world
  double m_base = 0.0;
  std::vector<Met> m_met;                           ///< places that rays may meet
  std::vector<Ray> m_locals;                        ///< [met][ray]
  std::vector<GridBeam> m_beams;                    ///< [met]
  std::vector<uint32_t> m_here;                     ///< those of m_met in the present slab
  std::vector<Path> m_sun_paths;                    ///< [place that shades][light]
  std::unordered_map<uint32_t, size_t> m_paths_of;  ///< where those of a place begin
  std::vector<uint32_t> m_candidates;
  std::vector<std::vector<Shading>> m_shading;  ///< [light]: in the present slab
};

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
