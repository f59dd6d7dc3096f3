#pragma once

#include <map>
#include <memory>
#include <vector>

#include "integrators/march_scene.h"
#include "integrators/media_shades.h"
#include "lib/geom/box_index.h"
#include "lib/volume/curvature_grid.h"
#include "lib/volume/known_columns.h"

namespace pileus {

/// What enclosures of a world's rays need: how much the optical depths towards its suns bend.
class EnclosedWorld {
 public:
  /// `march` fits `world`, which has grids, hazes that are KnownColumns, and suns only; all outlive this.
  /// Uses parallel_for.
  EnclosedWorld(const World& world, const EffectPlan& plan, const MarchWorld& march);

  const World& world() const { return m_world; }
  const MarchWorld& march() const { return m_march; }
  const EffectPlan& plan() const { return m_plan; }
  const MediaShades& shades() const { return m_shades; }

  bool has_hazes() const { return !m_haze_bounds.isEmpty(); }

  /// Optical depth of all media from a point towards a light, exactly.
  double depth(size_t light, const Vec3d& p, FieldCounters& counters) const;

  /// Upper bound of the total variation of d(tau)/ds, where tau(s) is the optical depth of all grids from
  /// middle + s * step towards a light, s in [-1/2, 1/2]. World space.
  double depth_variation(size_t light, const Vec3d& middle, const Vec3d& step) const;

  /// Upper bound of how far the optical depth of all hazes towards a light is from linear on a part of a ray.
  double haze_bend(size_t light, const Ray& ray, Segment part) const;

  /// A part of a ray in a grid, or in its shadow and perhaps in a haze: steps longer than a cell bend more.
  struct Zone {
    Segment along;
    double cells_per_metre;  ///< along the axis on which they are most
  };
  void append_zones(const Ray& ray, Segment segment, std::vector<Zone>& zones) const;

  size_t memory_bytes() const;

 private:
  /// A grid where it stands.
  struct Place {
    size_t grid;
    const CurvatureGrid* curvature;  ///< null where nothing is dimmed
    Affine local_from_world;
    Box3d box;  ///< of what is not 0, world
  };
  struct Haze {
    double extinction;
    const KnownColumns* columns;
  };
  struct Curvature {
    std::unique_ptr<const BrickPyramid> pyramid;  ///< of the voxels as they are, in floats
    std::unique_ptr<const CurvatureGrid> grid;
  };

  const CurvatureGrid* curvature_of(const WorldMedium& medium);
  void add_places();
  void add_place(size_t grid, const Affine& local_from_world);
  template <class Visit>
  void for_places_on(const Ray& ray, const Visit& visit) const;
  bool may_shade(const Place& place, size_t light, const Ray& ray, Segment segment) const;
  double depth_variation(const Place& place, size_t light, const Vec3d& middle, const Vec3d& step) const;

  const World& m_world;
  const EffectPlan& m_plan;
  const MarchWorld& m_march;
  MediaShades m_shades;
  std::map<const BrickGrid*, Curvature> m_curvatures;
  std::vector<Place> m_places;
  BoxIndex m_index;             ///< of where places bend, larger by the longest step
  double m_longest_step = 0.0;  ///< across a cell of any place [m]
  std::vector<Haze> m_hazes;    ///< that dim light
  Box3d m_haze_bounds;
};

}  // namespace pileus
