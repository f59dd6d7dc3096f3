#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "integrators/kernels/march_lamp.h"
#include "integrators/kernels/sun_nodes.h"
#include "lib/geom/box_index.h"
#include "lib/math/affine.h"
#include "lib/math/ray.h"
#include "lib/math/vec.h"
#include "lib/volume/brick_pyramid.h"

namespace pileus {

// The loops of `march`. One kernel source serves every instruction set (Highway); it is chosen once per tile.
//
// A lane is a ray. Sixteen rays, a square of 4 x 4 pixels, make a packet and take the same steps: the walk is
// scalar and paid for once per packet, every decision that adapts to the scene is made per slab of it, and
// what neighbouring rays read lies side by side in the caches. A packet is one vector of AVX-512, two of
// AVX2, four of SSE4, so that pictures differ between instruction sets by rounding alone.
//
// Cost model, per sample: 4 words of density, 4 of the sun's optical depth, 14 lerps, 2 exponentials, 68
// instructions in all, which wait for each other: two vectors step together to fill the time. Per slab of 8
// cells, for 16 rays: some 600 instructions.

inline constexpr size_t kPacketRays = 16;

inline constexpr int kMostTerms = 32;  ///< 16 octaves with powder

/// What light does in a medium.
struct MarchMedium {
  double extinction = 0.0;  ///< [1/m]
  double glow = 0.0;  ///< what a density of 1 adds to a ray without any light, largest channel [W/(m3 sr)]
  double glow_bound = 0.0;  ///< upper bound of what that makes of a whole ray [W/(m2 sr)]

  int terms = 1;                                    ///< scatter terms
  std::array<float, kMostTerms> term_extinction{};  ///< of each, relative to the medium's
};

/// A grid as the kernel sees it. Local space: cells, relative to the pyramid's origin.
struct MarchGrid : MarchMedium {
  const BrickPyramid* pyramid = nullptr;
  Affine local_from_world;
  Box3d bounds;  ///< of what is not 0, local
};

/// A place where a grid stands, of many.
struct MarchPlace {
  size_t grid = 0;
  Affine local_from_world;
  size_t kind = 0;           ///< MarchScene::kinds
  Affine kind_from_world;    ///< to where the kind's own place is in the world
  double depth_scale = 1.0;  ///< optical depths here, in units of those there
};

/// Places of a grid that are turned and stretched alike, but for a factor, share their optical depths.
struct MarchKind {
  size_t grid = 0;
  Affine local_from_world;  ///< of one of these places
};

/// Which places may stand between a sun and each of them, itself among them.
struct PlaceShading {
  std::vector<uint32_t> places;
  std::vector<std::pair<size_t, size_t>> of_place;  ///< where those of a place begin, and how many they are

  std::span<const uint32_t> of(size_t place) const {
    return std::span(places).subspan(of_place[place].first, of_place[place].second);
  }
};

/// An analytic medium, a haze, along a ray: its density grows as exp(rate * t) inside, and is 0 elsewhere.
struct HazeStretch {
  Segment inside;
  double densest = 0.0;  ///< at the end of it where the density is largest
  double rate = 0.0;     ///< [1/m]
};

/// Optical depth of all hazes from a point on a ray to a sun; linear between nodes.
struct HazeDepth {
  double t, depth;
};

/// The media are numbered: grids first, then hazes.
struct MarchScene {
  std::vector<MarchGrid> grids;
  std::vector<MarchMedium> hazes;
  std::vector<SunLattice> lattices;   ///< [light][kind]; empty ones for lamps
  std::vector<MarchKind> kinds;       ///< one per grid where each stands but once
  std::vector<MarchPlace> places;     ///< of all grids, where some stand in several; else none
  BoxIndex place_index;               ///< of their boxes in the world
  std::vector<PlaceShading> shading;  ///< [light]
  int lights = 0;
  std::vector<MarchLamp> lamps;        ///< lights that are no suns, ascending; none with hazes or places
  std::vector<LampPhase> lamp_phases;  ///< [medium]; where there are lamps
  bool several_terms = false;          ///< some grid has more than the plain term
  bool height_light = false;           ///< some light varies with height: the sums of heights are wanted
  bool is_leaping = true;              ///< false: every node counts as the densest and most varied of all
  bool wants_depth = false;            ///< `first` and `z_half` of results are wanted
  std::vector<Vec3d> towards_suns;     ///< unit vectors, world; of lamps they mean nothing
  double shadow_step = 0.0;            ///< of shadow rays [cells]; 0: lattices are read instead
  double enough_shadow = 0.0;          ///< optical depth at which shadow rays may end
  double shadow_width = 0.0;           ///< of what the smallest grid throws onto hazes; its details [m]

  /// Null where a light is a sun.
  const MarchLamp* lamp(size_t light) const {
    for (const MarchLamp& lamp : lamps)
      if (lamp.light == int(light)) return &lamp;
    return nullptr;
  }

  size_t media() const { return grids.size() + hazes.size(); }
  const MarchMedium& medium(size_t i) const { return i < grids.size() ? grids[i] : hazes[i - grids.size()]; }
};

/// Fog in front of the media of a ray, linear between nodes in equal distances.
struct MarchFog {
  double t0 = 0.0, nodes_per_metre = 0.0;  ///< the first node lies at t0
  std::vector<std::array<float, 4>>
      nodes;       ///< transmittance, and the light of the fog in three channels; two or more
  Rgb light{0.0};  ///< written by the march: the light of the fog in front of the media
};

/// What a ray asks for.
struct MarchRay {
  Ray ray;
  Segment segment;
  const float* weights = nullptr;  ///< [medium][light][kMostTerms]: phase weights [1/sr] times the light's
                                   ///< strongest channel; 0 for lamps
  double step_quality =
      0.0;  ///< how much error a step may make [1]: the error of the ray is in proportion to it
  double height0 = 0.0, height1 = 0.0;  ///< height at t [m]: height0 + t * height1
  double behind = 0.0;                  ///< radiance that arrives from the end of the ray, largest channel
  double brightest = 0.0;               ///< no light on the ray is brighter, largest channel
  double lamplight = 0.0;               ///< the part of it that lamps may have [W/(m2 sr)]
  double lamp_rounding = 0.0;           ///< what rounding changes of that light on the whole ray
  double stop = 0.0;                    ///< transmittance at which the ray ends
  const std::vector<Segment>* lit = nullptr;  ///< [light]: stretches that solids do not shade, ascending;
                                              ///< null: all. Of all rays of a packet or of none
  MarchFog* fog = nullptr;                    ///< null: none. Of all rays or of none
  Segment grid_shadows;                       ///< grids may shade hazes nowhere else
  const HazeStretch* hazes = nullptr;         ///< [haze]
  const std::vector<HazeDepth>* haze_depths = nullptr;  ///< [light], ascending
};

/// What it gets, besides MarchSums.
struct MarchResult {
  double tau = 0.0;
  Segment first;        ///< the first sample with a density at its end, what is before it at its start
  double z_half = 0.0;  ///< where the transmittance falls below one half
  double error = 0.0;   ///< estimated, from second differences of the samples
  uint64_t samples = 0, lookups = 0, leaps = 0;
};

/// sums[medium][2 + lights]: the integral of T rho dt [m]; of T sigma_t times the height; then for each
/// light of T sigma_t R, with R the weighted sum of the medium's terms.
inline size_t sums_per_medium(const MarchScene& scene) {
  return 2 + size_t(scene.lights);
}

/// Marches rays, sixteen in a row as a packet; `sums` has rays.size() * media() * sums_per_medium() values.
void march_rays(const MarchScene& scene, std::span<const MarchRay> rays, std::span<MarchResult> results,
                std::span<double> sums);

/// Name of the instruction set that the kernels use on this machine.
const char* march_target();

}  // namespace pileus
