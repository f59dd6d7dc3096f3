#pragma once

#include <memory>
#include <span>
#include <vector>

#include "lib/core/registry.h"
#include "lib/math/vec.h"
#include "lib/scene/light.h"

namespace pileus {

struct Texture;
struct TexturedPoint;

/// A point of a surface that is looked at.
struct SurfacePoint {
  Vec3d p;                   ///< world space [m]
  Vec3d n;                   ///< unit normal on the viewer's side
  double footprint = 0.0;    ///< width of the pixel's cone at p, across the ray [m]; 0: unknown
  bool is_inside = false;    ///< the viewer is inside the solid
  Rgb sky{0.0, 0.0, 0.0};    ///< irradiance by the background, for shaders that want it [W/m2]
  Rgb color{1.0, 1.0, 1.0};  ///< of the texture: diffuse and ambient reflectances are multiplied by it
  double opacity = 1.0;      ///< of the textures: the share of all that the surface does
};

/// A direction from which a surface takes light that is not that of a lamp.
struct ScatteredRay {
  Vec3d d;              ///< unit vector away from the point
  Rgb weight;           ///< of the radiance that arrives from there
  bool passes = false;  ///< goes through the surface
};

/// What a solid surface does with light (the plugin), and which textures it has (the common part).
struct SurfaceShader : Plugin {
  static constexpr const char* kKind = "surface";

  std::shared_ptr<const Texture> texture;          ///< colour and opacity; null: none
  std::shared_ptr<const Texture> opacity_texture;  ///< a further opacity; null: none

  void describe(ParamTable& params) final;

  /// The parameters of the plugin.
  virtual void describe_surface(ParamTable& params) = 0;

  bool has_texture() const { return texture || opacity_texture; }

  /// True where textures may let light pass through the surface.
  bool has_holes() const;

  /// The product of what the textures say there, 0 .. 1.
  double opacity_at(const TexturedPoint& point) const;

  /// Radiance leaving a point towards wo [W/(m2 sr)]. Each light's irradiance already carries the
  /// transmittance of what lies between.
  virtual Rgb shade(const SurfacePoint& point, const Vec3d& wo,
                    std::span<const Illumination> lights) const = 0;

  /// Appends what the point shows besides, by mirror or by refraction: seldom more than two directions. The
  /// weights of one point should add up to no more than 1.
  virtual void append_scattered(const SurfacePoint& point, const Vec3d& wo,
                                std::vector<ScatteredRay>& rays) const {
    (void)point, (void)wo, (void)rays;
  }

  /// Whether append_scattered() ever appends a ray on the viewer's side, or one that passes. What is
  /// transparent casts no shadow.
  virtual bool is_mirror() const { return false; }
  virtual bool is_transparent() const { return false; }

  /// True where shade() uses SurfacePoint::sky.
  virtual bool wants_sky() const { return false; }

  /// Absorption coefficient of the solid behind the surface [1/m].
  virtual Rgb absorption_inside() const { return Rgb(0.0); }
};

}  // namespace pileus
