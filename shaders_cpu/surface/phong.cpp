/// Phong surface: diffuse reflection with a round highlight.
///
///   L = k_a L_a + sum over lights of E * (k_d / pi * max(0, N.L) + k_s / pi * max(0, R.V)^n)
///
///   diffuse            k_d, diffuse reflectance            [1]           0 .. 1, default 0.8 per channel
///   specular           k_s, strength of the highlight      [1]           0 .. 1, default 0 per channel
///   shininess          n, sharpness of the highlight       [1]           > 0, default 32
///   ambient            k_a, reflectance of ambient light   [1]           0 .. 1, default 0.8 per channel
///   ambient_radiance   L_a, arriving from everywhere       [W/(m2 sr)]   >= 0, default 0 per channel
///
///   shader = { type = "phong", diffuse = [0.7, 0.2, 0.1], specular = [0.3, 0.3, 0.3], shininess = 60 }
///
/// E is the irradiance of a surface that faces the light, after all that lies in its way. Both terms carry
/// 1/pi: a white diffuse surface that faces the light shows E / pi. R is the mirror image of the direction to
/// the light; a light below the horizon of the surface gives no highlight. The highlight is that of the
/// classical model: its energy falls as n grows. ref: Phong 1975; METHODS 12
#include <numbers>

#include "lib/core/param_table.h"
#include "lib/math/specular.h"
#include "lib/scene/surface_shader.h"

namespace pileus {
namespace {

struct Phong final : SurfaceShader {
  Rgb m_diffuse{0.8, 0.8, 0.8};
  Rgb m_specular{0.0, 0.0, 0.0};
  double m_shininess = 32.0;
  Rgb m_ambient{0.8, 0.8, 0.8};
  Rgb m_ambient_radiance{0.0, 0.0, 0.0};

  void describe(ParamTable& params) override {
    params.rgb("diffuse", m_diffuse, "", "diffuse reflectance").at_least(0).at_most(1);
    params.rgb("specular", m_specular, "", "strength of the highlight").at_least(0).at_most(1);
    params.number("shininess", m_shininess, "", "sharpness of the highlight").above(0);
    params.rgb("ambient", m_ambient, "", "reflectance of ambient light").at_least(0).at_most(1);
    params.rgb("ambient_radiance", m_ambient_radiance, "W/(m2 sr)", "arriving from everywhere").at_least(0);
  }
  Rgb shade(const SurfacePoint& point, const Vec3d& wo, std::span<const Illumination> lights) const override {
    const Vec3d& n = point.n;
    Rgb sum = m_ambient * m_ambient_radiance;
    for (const Illumination& light : lights) {
      const double cosine = dot(n, light.wi);
      if (!(cosine > 0.0)) continue;
      const Vec3d mirrored = 2.0 * cosine * n - light.wi;
      const Vec3d off_peak = mirrored - wo;
      const double highlight = specular_power(0.5 * dot(off_peak, off_peak), m_shininess);
      sum += light.irradiance * std::numbers::inv_pi * (m_diffuse * cosine + m_specular * highlight);
    }
    return sum;
  }
};

}  // namespace

PILEUS_PLUGIN(SurfaceShader, phong, Phong, "diffuse reflection with a round highlight")

}  // namespace pileus
