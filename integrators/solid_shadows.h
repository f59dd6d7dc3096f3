#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "integrators/kernels/march_kernel.h"
#include "lib/scene/world.h"

namespace pileus {

/// Where solids let the light of suns through to the media along a ray. What a sun lights of a ray is found
/// once per ray, from the edges that shapes tell (Shape::append_shadow_edges); where a shape cannot tell them
/// all, by samples as far apart as voxels and bisection. Packets that no solid can shade pay for one look at
/// its box. Solids with holes are not looked at, but told of.
class SolidShadows {
 public:
  /// A world whose lights are all suns.
  ///   least_depth: optical depth of haze in which a shadow may be missed where shapes do not tell its edges
  explicit SolidShadows(const World& world, double least_depth = 0.03);

  /// False where no solid shades any medium.
  bool any() const { return m_any; }

  /// True where a solid with holes may shade some of a packet: what it lets through has no edges to be told.
  bool is_dappled(std::span<const MarchRay> packet) const;

  /// Gives the rays of one packet their lit stretches, where a solid may shade some of them.
  ///   lit: [ray][light], to be kept as long as the rays are marched
  /// Returns the number of shadow rays this took.
  uint64_t find(std::span<MarchRay> packet, std::span<std::vector<Segment>> lit) const;

 private:
  using Casters = std::vector<std::vector<const Shape*>>;  ///< [light]: shapes that may shade a medium

  /// One of them, for the rays of a packet.
  struct PacketCaster {
    const Shape* shape;
    std::vector<Segment> clear;  ///< stretches of all rays that it surely does not shade
  };

  Casters casters_of(std::span<const MarchRay> packet, const Casters& all) const;

  /// What one sun lights of one ray, as far as it has been found.
  struct LitRay {
    const Ray& ray;
    size_t light;
    std::span<const PacketCaster> casters;
    std::vector<Segment>& stretches;
    uint64_t& shadow_rays;
  };

  PacketCaster caster_of(const Shape& shape, size_t light, std::span<const MarchRay> packet,
                         Segment media) const;
  void append_lit(const LitRay& to, Segment segment) const;
  void append_lit_between(const LitRay& to, Segment segment) const;
  void append_ends(const LitRay& to, Segment segment, std::vector<double>& ends) const;
  double step_at(const Vec3d& p) const;
  bool is_lit(const LitRay& to, double t) const;
  Segment inside_media(const Ray& ray, Segment segment) const;

  const World& m_world;
  double m_least_depth;
  std::vector<Vec3d> m_towards_suns;
  Casters m_casters;        ///< without holes, anywhere
  Casters m_holed_casters;  ///< with holes
  bool m_any = false;
};

}  // namespace pileus
