#pragma once

#include <numbers>
#include <vector>

#include "lib/core/param_table.h"
#include "lib/math/dielectric.h"
#include "lib/scene/surface_shader.h"

namespace pileus {

/// What Phong's surface and Blinn's share: all but the form of the highlight. The documentation is that of
/// phong.cpp. ref: METHODS 12
struct ClassicSurface : SurfaceShader {
  Rgb m_diffuse{0.8, 0.8, 0.8};
  Rgb m_specular{0.0, 0.0, 0.0};
  double m_shininess = 32.0;
  Rgb m_ambient{0.8, 0.8, 0.8};
  Rgb m_ambient_radiance{0.0, 0.0, 0.0};
  double m_sky = 0.0;
  Rgb m_mirror{0.0, 0.0, 0.0};
  Rgb m_transparency{0.0, 0.0, 0.0};
  double m_ior = 1.0;

  /// (cos)^n of the highlight for a light above the horizon, 0 .. 1.
  virtual double highlight(const Vec3d& n, const Vec3d& wo, const Vec3d& wi) const = 0;

  void describe_surface(ParamTable& params) final {
    params.rgb("diffuse", m_diffuse, "", "diffuse reflectance").at_least(0).at_most(1);
    params.rgb("specular", m_specular, "", "strength of the highlight").at_least(0).at_most(1);
    params.number("shininess", m_shininess, "", "sharpness of the highlight").above(0);
    params.rgb("ambient", m_ambient, "", "reflectance of ambient light").at_least(0).at_most(1);
    params.rgb("ambient_radiance", m_ambient_radiance, "W/(m2 sr)", "arriving from everywhere").at_least(0);
    params.number("sky", m_sky, "", "share of the background's light in the ambient light").at_least(0);
    params.rgb("mirror", m_mirror, "", "share of what is reflected that shows").at_least(0).at_most(1);
    params.rgb("transparency", m_transparency, "", "share of what lies behind that shows")
        .at_least(0)
        .at_most(1);
    params.number("ior", m_ior, "", "refractive index of the inside").above(0);
  }

  Rgb shade(const SurfacePoint& point, const Vec3d& wo, std::span<const Illumination> lights) const final {
    const Rgb diffuse = m_diffuse * point.color;
    Rgb sum = m_ambient * point.color * (m_ambient_radiance + m_sky * std::numbers::inv_pi * point.sky);
    const bool is_dull = m_specular == Rgb(0.0);
    for (const Illumination& light : lights) {
      const double cosine = dot(point.n, light.wi);
      if (!(cosine > 0.0)) continue;
      sum += light.irradiance * std::numbers::inv_pi *
             (diffuse * cosine + m_specular * (is_dull ? 0.0 : highlight(point.n, wo, light.wi)));
    }
    return sum;
  }

  void append_scattered(const SurfacePoint& point, const Vec3d& wo,
                        std::vector<ScatteredRay>& rays) const final {
    if (is_mirror()) rays.push_back({mirrored(point.n, wo), m_mirror, false});
    if (!is_transparent()) return;
    const auto onward = refracted(point.n, wo, point.is_inside ? 1.0 / m_ior : m_ior);
    rays.push_back({onward.value_or(mirrored(point.n, wo)), m_transparency, onward.has_value()});
  }

  bool is_mirror() const final { return m_mirror != Rgb(0.0); }
  bool is_transparent() const final { return m_transparency != Rgb(0.0); }
  bool wants_sky() const final { return m_sky > 0.0; }
};

}  // namespace pileus
