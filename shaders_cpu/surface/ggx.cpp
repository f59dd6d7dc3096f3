/// A physically based surface: diffuse below a glossy coat of microfacets, or metal.
///
///   base_color   colour of the diffuse part, or of the metal      [1]   0 .. 1, default 0.8 per channel
///   roughness    0 a mirror, 1 no gloss to speak of               [1]   0 .. 1, default 0.5
///   metallic     0 dielectric, 1 metal                            [1]   0 .. 1, default 0
///   ior          refractive index of the dielectric coat          [1]   >= 1, default 1.5
///   sky          share of the background's light that it receives [1]   >= 0, default 0
///
///   shader = { type = "ggx", base_color = [0.9, 0.6, 0.2], roughness = 0.3, metallic = 1 }
///
///   L    = sum over lights of E * (N.L) * (f_d + f_s) + sky E_sky / pi ((1 - metallic) (1 - F_c) base + F0)
///   f_s  = D(N.H) V(N.L, N.V) F(L.H),   D, V: GGX with height-correlated Smith masking, alpha = roughness^2
///   f_d  = (1 - metallic) base / pi (1 - F_coat(N.L)) (1 - F_coat(N.V))
///   F(c) = F0 + (1 - F0) (1 - c)^5,     F0 = metallic base + (1 - metallic) F_c
///   F_coat: the same with F_c = ((ior - 1) / (ior + 1))^2 for F0
///
/// Reciprocal, and reflects no more than it gets: light that microfacets scatter among each other is lost,
/// some of it at high roughness. At roughness 0 the coat is a mirror for what is around, sun discs among it,
/// and lamps show no highlight; a rougher one reflects lamps, and of the surroundings only the sky as a
/// whole. ref: Walter et al. 2007; Heitz 2014; Schlick 1994; the diffuse part after Ashikhmin and Shirley
/// 2000
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "lib/core/param_table.h"
#include "lib/math/dielectric.h"
#include "lib/scene/surface_shader.h"

namespace pileus {
namespace {

constexpr double kLeastAlpha2 = 1e-30;  ///< squares of it are still numbers

double fifth_power(double x) {
  return (x * x) * (x * x) * x;
}

struct Ggx final : SurfaceShader {
  Rgb m_base{0.8, 0.8, 0.8};
  double m_roughness = 0.5;
  double m_metallic = 0.0;
  double m_ior = 1.5;
  double m_sky = 0.0;

  void describe_surface(ParamTable& params) override {
    params.rgb("base_color", m_base, "", "of the diffuse part, or of the metal").at_least(0).at_most(1);
    params.number("roughness", m_roughness, "", "0 a mirror, 1 no gloss").at_least(0).at_most(1);
    params.number("metallic", m_metallic, "", "0 dielectric, 1 metal").at_least(0).at_most(1);
    params.number("ior", m_ior, "", "refractive index of the dielectric coat").at_least(1);
    params.number("sky", m_sky, "", "share of the background's light that it receives").at_least(0);
  }

  Rgb shade(const SurfacePoint& point, const Vec3d& wo, std::span<const Illumination> lights) const override {
    Rgb sum = (m_sky * std::numbers::inv_pi) * point.sky *
              ((1.0 - coat_reflectance()) * diffuse(point.color) + normal_reflectance(point.color));
    for (const Illumination& light : lights) {
      const double cosine = dot(point.n, light.wi);
      if (cosine > 0.0) sum += light.irradiance * (cosine * reflected(point, wo, light.wi));
    }
    return sum;
  }

  void append_scattered(const SurfacePoint& point, const Vec3d& wo,
                        std::vector<ScatteredRay>& rays) const override {
    if (is_mirror()) rays.push_back({mirrored(point.n, wo), fresnel(dot(point.n, wo), point.color), false});
  }
  bool is_mirror() const override { return m_roughness == 0.0; }
  bool wants_sky() const override { return m_sky > 0.0; }

 private:
  /// f_d + f_s [1/sr].
  Rgb reflected(const SurfacePoint& point, const Vec3d& wo, const Vec3d& wi) const {
    const double to_light = dot(point.n, wi), to_viewer = dot(point.n, wo);
    const double both_ways = through_coat(to_light) * through_coat(to_viewer);
    return diffuse(point.color) * (both_ways * std::numbers::inv_pi) + microfacets(point, wo, wi);
  }

  Rgb microfacets(const SurfacePoint& point, const Vec3d& wo, const Vec3d& wi) const {
    const Vec3d& n = point.n;
    const double norm = length(wo + wi), l = dot(n, wi), v = dot(n, wo);
    if (is_mirror() || !(norm > 0.0) || !(v > 0.0)) return Rgb(0.0);
    const Vec3d h = (wo + wi) / norm;
    const double alpha2 = std::max(std::pow(m_roughness, 4), kLeastAlpha2);
    // 1 - (N.H)^2 by the sine: sharp highlights keep their digits.
    const double peak = dot(n, h), off_peak = cross(n, h).length2() + peak * peak * alpha2;
    const double d = alpha2 * std::numbers::inv_pi / (off_peak * off_peak);
    const double masking =
        l * std::sqrt(v * v * (1.0 - alpha2) + alpha2) + v * std::sqrt(l * l * (1.0 - alpha2) + alpha2);
    return fresnel(dot(wi, h), point.color) * (d * 0.5 / masking);
  }

  Rgb diffuse(const Rgb& color) const { return (1.0 - m_metallic) * m_base * color; }

  /// F_c.
  double coat_reflectance() const {
    const double r = (m_ior - 1.0) / (m_ior + 1.0);
    return r * r;
  }

  /// 1 - F_coat.
  double through_coat(double cosine) const {
    return (1.0 - coat_reflectance()) * (1.0 - fifth_power(std::clamp(1.0 - cosine, 0.0, 1.0)));
  }

  /// F0.
  Rgb normal_reflectance(const Rgb& color) const {
    return m_metallic * m_base * color + Rgb((1.0 - m_metallic) * coat_reflectance());
  }

  Rgb fresnel(double cosine, const Rgb& color) const {
    const Rgb f0 = normal_reflectance(color);
    return f0 + (Rgb(1.0) - f0) * fifth_power(std::clamp(1.0 - cosine, 0.0, 1.0));
  }
};

}  // namespace

PILEUS_PLUGIN(SurfaceShader, ggx, Ggx, "physically based: diffuse under GGX microfacets, or metal")

}  // namespace pileus
