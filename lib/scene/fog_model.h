#pragma once

#include <string>
#include <vector>

#include "lib/core/registry.h"
#include "lib/fog/fog_piece.h"
#include "lib/math/ray.h"
#include "lib/scene/light.h"

namespace pileus {

/// What fog may look at besides the ray.
struct FogView {
  Vec3d axis{0.0, 0.0, -1.0};  ///< unit vector along which the camera looks
  Illumination sun{
      {0.0, 1.0, 0.0}, 0.0, Rgb(0.0)};  ///< the light that the fog names; dark where it names none
};

/// Fog between the camera and what a ray shows: it dims that and adds its own colour, in closed form. It
/// neither casts shadows nor gets any.
struct FogModel : Plugin {
  static constexpr const char* kKind = "fog";

  /// False where it changes nothing: the effect plan says so.
  virtual bool is_visible() const = 0;

  /// Name of the sun that lights it, "" where it has its own colour.
  virtual std::string sun_name() const { return {}; }

  /// Appends what the fog is along a ray, from its origin on: disjoint pieces with 0 <= t0.
  virtual void append_pieces(const Ray& ray, const FogView& view, std::vector<FogPiece>& pieces) const = 0;
};

}  // namespace pileus
