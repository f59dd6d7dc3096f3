#pragma once

#include <string>
#include <vector>

#include "lib/core/registry.h"
#include "lib/math/affine.h"
#include "lib/math/vec.h"
#include "lib/scene/medium.h"

namespace pileus {

/// A point of a surface as a texture sees it.
struct TexturedPoint {
  Vec3d p;
  Vec3d n;     ///< unit normal
  Vec3d a, b;  ///< edges of the part of the surface that the ray covers
};

/// What a texture says of a point.
struct TextureValue {
  Rgb color{1.0, 1.0, 1.0};  ///< linear, 0 .. 1
  double opacity = 1.0;      ///< 0 .. 1
};

/// A colour for every point of space: a pattern (the plugin) in a place of its own (the common part). It
/// belongs to the world, not to what it lies on: surfaces name it, several may name the same, and one that
/// moves passes beneath it.
struct Texture : Plugin {
  static constexpr const char* kKind = "texture";

  void describe(ParamTable& params) final;
  void commit(std::vector<std::string>& problems) final;

  /// The colour and opacity at a point of world space [m].
  TextureValue at(const TexturedPoint& world) const;

  /// False where some point may be less than opaque.
  bool is_opaque() const { return m_opacity == "full" || (m_opacity == "alpha" && is_pattern_opaque()); }

  /// The parameters of the pattern.
  virtual void describe_pattern(ParamTable& params) = 0;
  virtual void commit_pattern(std::vector<std::string>& problems) { (void)problems; }

  virtual bool is_pattern_opaque() const { return true; }

  /// The pattern at a point of the texture's own space.
  virtual TextureValue pattern(const TexturedPoint& point) const = 0;

 private:
  Placement m_placement;
  std::string m_opacity = "alpha";
  Affine m_world_from_texture, m_texture_from_world;
};

}  // namespace pileus
