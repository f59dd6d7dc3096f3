/// Phong surface: diffuse reflection with a round highlight.
///
///   L = k_a (L_a + sky E_sky / pi) + sum over lights of E (k_d / pi max(0, N.L) + k_s / pi max(0, R.V)^n)
///       + k_r I_r + k_t I_t
///
///   diffuse            k_d, diffuse reflectance            [1]           0 .. 1, default 0.8 per channel
///   specular           k_s, strength of the highlight      [1]           0 .. 1, default 0 per channel
///   shininess          n, sharpness of the highlight       [1]           > 0, default 32
///   ambient            k_a, reflectance of ambient light   [1]           0 .. 1, default 0.8 per channel
///   ambient_radiance   L_a, arriving from everywhere       [W/(m2 sr)]   >= 0, default 0 per channel
///   sky                share of the background's light     [1]           >= 0, default 0
///   mirror             k_r, of what is mirrored            [1]           0 .. 1, default 0 per channel
///   transparency       k_t, of what lies behind            [1]           0 .. 1, default 0 per channel
///   ior                refractive index of the inside      [1]           > 0, default 1
///
///   shader = { type = "phong", diffuse = [0.7, 0.2, 0.1], specular = [0.3, 0.3, 0.3], shininess = 60 }
///
/// E is the irradiance of a surface that faces the light, after all that lies in its way. Both terms carry
/// 1/pi: a white diffuse surface that faces the light shows E / pi. R is the mirror image of the direction to
/// the light; a light below the horizon of the surface gives no highlight. The highlight is that of the
/// classical model: its energy falls as n grows.
///
/// E_sky is the irradiance by the background. I_r and I_t are what is seen in the mirror direction and, after
/// Snell, through the surface; where nothing can pass, I_t comes from the mirror direction, too. The
/// documents have one k_s for the highlight and for I_r: set `mirror` like `specular` for that. ref: Phong
/// 1975; METHODS 12
#include "lib/math/specular.h"
#include "shaders_cpu/surface/classic_surface.h"

namespace pileus {
namespace {

struct Phong final : ClassicSurface {
  double highlight(const Vec3d& n, const Vec3d& wo, const Vec3d& wi) const override {
    const Vec3d off_peak = 2.0 * dot(n, wi) * n - wi - wo;
    return specular_power(0.5 * dot(off_peak, off_peak), m_shininess);
  }
};

}  // namespace

PILEUS_PLUGIN(SurfaceShader, phong, Phong, "diffuse reflection with a round highlight")

}  // namespace pileus
