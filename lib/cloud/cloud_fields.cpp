#include "lib/cloud/cloud_fields.h"

#include <algorithm>
#include <array>

#include "lib/cloud/procedural_cloud.h"
#include "lib/core/param_table.h"

namespace pileus {

namespace {

constexpr int kEddySizes = 3;

/// The curl's root mean square over space is about this for one octave: `turbulence` is a typical speed.
constexpr double kCurlSize = 1.6;

/// Where the three components of the potential lie in the noise [lattice units].
const std::array<Vec3d, 3> kPotentialShifts{Vec3d{31.17, 7.61, 19.43}, Vec3d{67.71, 43.13, 5.89},
                                            Vec3d{13.37, 91.53, 27.79}};

}  // namespace

void CloudFieldsRecipe::describe(ParamTable& params) {
  params.group(
      "temperature",
      [this](ParamTable& p) {
        p.number("base", temperature, "K", "at the bottom of the cloud").at_least(0);
        p.number("lapse", lapse, "K/m", "how much colder a metre higher up");
        p.number("excess", excess, "K", "how much warmer where the density is 1");
      },
      "the grid temperature of pileus cloud --grids");
  params.group(
      "color",
      [this](ParamTable& p) {
        p.rgb("bottom", color_bottom, "", "at the bottom of the cloud").at_least(0);
        p.rgb("top", color_top, "", "at its top").at_least(0);
      },
      "the grid Cd, unless a texture gives the colour");
  params.group(
      "velocity",
      [this](ParamTable& p) {
        p.vector("wind", wind, "m/s", "everywhere");
        p.number("updraft", updraft, "m/s", "upwards where the density is 1");
        p.number("turbulence", turbulence, "m/s", "speed of the eddies").at_least(0);
      },
      "the grid vel");
}

CloudFields::CloudFields(const CloudFieldsRecipe& recipe, const ProceduralCloud& cloud)
    : m_recipe(recipe),
      m_shape(cloud.shape()),
      m_texture(cloud.texture()),
      m_noise(uint64_t(cloud.recipe().noise.seed)),
      m_frequency(cloud.noise_frequency()) {}

double CloudFields::temperature(const Vec3d& p_world, double rho) const {
  return m_recipe.temperature - m_recipe.lapse * (p_world.y - m_shape.bounds().min.y) + m_recipe.excess * rho;
}

Rgb CloudFields::color(const Vec3d& p_world) const {
  if (m_texture) return m_texture->color(p_world);
  const double height = std::clamp(m_shape.relative_height(p_world.y), 0.0, 1.0);
  return m_recipe.color_bottom * (1 - height) + m_recipe.color_top * height;
}

Vec3d CloudFields::velocity(const Vec3d& p_world, double rho) const {
  const Vec3d steady = m_recipe.wind + Vec3d(0, m_recipe.updraft * rho, 0);
  return m_recipe.turbulence > 0 ? steady + curl(p_world) * m_recipe.turbulence : steady;
}

Vec3d CloudFields::curl(const Vec3d& p_world) const {
  Vec3d sum(0.0);
  double amplitude = 1 / kCurlSize, frequency = m_frequency;
  for (int i = 0; i < kEddySizes; ++i, amplitude *= 0.5, frequency *= 2) {
    std::array<Vec3d, 3> slopes;  // of the potential's components, per cell
    for (size_t c = 0; c < 3; ++c)
      slopes[c] = m_noise.sample(p_world * frequency + kPotentialShifts[c]).gradient;
    sum += amplitude * Vec3d(slopes[2].y - slopes[1].z, slopes[0].z - slopes[2].x, slopes[1].x - slopes[0].y);
  }
  return sum;
}

}  // namespace pileus
