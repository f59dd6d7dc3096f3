/// Blinn-Phong surface: diffuse reflection with a highlight by the half vector.
///
///   L = k_a L_a + sum over lights of E * (k_d / pi * max(0, N.L) + k_s / pi * (N.H)^n)
///
/// H halves the angle between the directions to the light and to the viewer; light from right behind has no
/// such direction and gives no highlight. All parameters are those of `phong`; the same highlight needs a
/// shininess about four times as high, as the angle at H is about half that at R. At grazing view the
/// highlight is stretched, as those of real surfaces are.
///
///   shader = { type = "blinn_phong", diffuse = [0.7, 0.2, 0.1], specular = [0.3, 0.3, 0.3], shininess = 240
///   }
///
/// ref: Blinn 1977; METHODS 12
#include "lib/math/specular.h"
#include "shaders_cpu/surface/classic_surface.h"

namespace pileus {
namespace {

struct BlinnPhong final : ClassicSurface {
  double highlight(const Vec3d& n, const Vec3d& wo, const Vec3d& wi) const override {
    const Vec3d sum = wo + wi;
    const double norm = length(sum);
    if (!(norm > 0.0)) return 0.0;
    const Vec3d off_peak = n - sum / norm;
    return specular_power(0.5 * dot(off_peak, off_peak), m_shininess);
  }
};

}  // namespace

PILEUS_PLUGIN(SurfaceShader, blinn_phong, BlinnPhong, "diffuse reflection with a highlight by half vectors")

}  // namespace pileus
