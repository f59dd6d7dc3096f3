/// Glass: a smooth, clear surface that reflects and refracts, around an inside that may absorb.
///
///   ior          refractive index of the inside, outside is 1    [1]     > 0, default 1.5
///   absorption   of the inside                                   [1/m]   >= 0, default 0 per channel
///
///   [object.ball]
///   type = "sphere"
///   shader = { type = "glass", ior = 1.5, absorption = [0.9, 0.2, 0.3] }
///
/// Fresnel's equations for unpolarised light share the view out between the mirror direction and that of
/// Snell; beyond the critical angle all is reflected. On its way inside, light falls by exp(-absorption t).
/// The inside is what the object encloses; that of a plane lies behind its normal. Where insides overlap,
/// their absorptions add up; indices do not mix: each surface refracts as if alone.
///
/// Carried on is radiance / index^2, which refraction keeps: what lies in glass is as bright as without it.
/// Light does not find its way through glass to other surfaces: instead, glass casts no shadow. Lamps show
/// no highlight on it; the disc of a sun (`disc_deg`) is reflected like all else. ref: METHODS 12
#include <vector>

#include "lib/core/param_table.h"
#include "lib/math/dielectric.h"
#include "lib/scene/surface_shader.h"

namespace pileus {
namespace {

struct Glass final : SurfaceShader {
  double m_ior = 1.5;
  Rgb m_absorption{0.0, 0.0, 0.0};

  void describe_surface(ParamTable& params) override {
    params.number("ior", m_ior, "", "refractive index of the inside").above(0);
    params.rgb("absorption", m_absorption, "1/m", "of the inside").at_least(0);
  }
  Rgb shade(const SurfacePoint&, const Vec3d&, std::span<const Illumination>) const override {
    return Rgb(0.0);
  }
  void append_scattered(const SurfacePoint& point, const Vec3d& wo,
                        std::vector<ScatteredRay>& rays) const override {
    const double eta = point.is_inside ? 1.0 / m_ior : m_ior;
    const auto onward = refracted(point.n, wo, eta);
    const double reflectance = onward ? fresnel_reflectance(dot(point.n, wo), eta) : 1.0;
    if (onward) rays.push_back({*onward, Rgb(1.0 - reflectance), true});
    rays.push_back({mirrored(point.n, wo), Rgb(reflectance), false});
  }
  bool is_mirror() const override { return true; }
  bool is_transparent() const override { return true; }
  Rgb absorption_inside() const override { return m_absorption; }
};

}  // namespace

PILEUS_PLUGIN(SurfaceShader, glass, Glass, "reflects and refracts; the inside may absorb")

}  // namespace pileus
