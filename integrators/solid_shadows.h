#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "integrators/kernels/march_kernel.h"
#include "integrators/shadow_search.h"
#include "lib/math/segments.h"
#include "lib/scene/world.h"

namespace pileus {

/// Where solids let the light through to the media along a ray. What a light reaches of a ray is found
/// once per ray: from the edges that shapes tell (Shape::append_shadow_edges), or, where a shape does not
/// know them, by a search in the stretches that it may shade (search_shadows). Packets that no solid can
/// shade pay for one look at its box. Solids with holes are not looked at, but told of.
class SolidShadows {
 public:
  /// A world whose lights are suns and, where all shapes know the edges of their shadows, points.
  ///   least_depth: optical depth of haze in which a shadow may be missed where shapes do not know its edges;
  ///   shadows of a 600th of it are negligible
  explicit SolidShadows(const World& world, double least_depth = 0.03);

  /// False where no solid shades any medium.
  bool any() const { return m_any; }

  /// Marks the rays of a packet that a solid with holes may shade: what it lets through has no edges to be
  /// told.
  void mark_dappled(std::span<const MarchRay> jobs, std::span<char> dappled) const;

  /// Gives the rays of one packet their lit stretches, where a solid shades some of them.
  ///   lit: [ray][light], to be kept as long as the rays are marched
  /// Returns the number of shadow rays this took.
  uint64_t find(std::span<MarchRay> jobs, std::span<std::vector<Segment>> lit) const;

 private:
  using Casters = std::vector<std::vector<const Shape*>>;  ///< [light]: shapes that may shade a medium

  /// The rays of a packet, as far as they pass through media.
  struct Packet {
    std::vector<Ray> rays;
    std::vector<Segment> inside;  ///< all media of each
  };

  bool may_shade(const Shape& shape, const Box3d& box, size_t light) const;
  Casters casters_of(std::span<const MarchRay> packet, const Casters& all) const;
  Packet packet_of(std::span<const MarchRay> jobs) const;
  Segment inside_media(const Ray& ray, Segment segment) const;
  uint64_t find_by_edges(const Shape& shape, size_t light, const Packet& packet,
                         std::span<Segments> shadows) const;
  uint64_t search(const Shape& shape, size_t light, const Packet& packet, std::span<double> left_out,
                  std::span<Segments> shadows) const;
  Segments clear_stretches(const Shape& shape, size_t light, const Packet& packet, Segment reach) const;

  const World& m_world;
  SearchDetail m_detail;
  std::vector<Vec3d> m_towards_suns;
  Casters m_casters;        ///< without holes, anywhere
  Casters m_holed_casters;  ///< with holes
  bool m_any = false;
};

}  // namespace pileus
