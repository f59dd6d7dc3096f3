#include "lib/scene/texture.h"

#include <cmath>

#include "lib/math/luminance.h"

namespace pileus {

void Texture::describe(ParamTable& params) {
  describe_pattern(params);
  params.text("opacity", m_opacity, "what makes it opaque: its alpha, its brightness, its darkness, anything")
      .one_of({"alpha", "luminance", "inverse_luminance", "full"});
  m_placement.describe(params);
}

void Texture::commit(std::vector<std::string>& problems) {
  m_world_from_texture = m_placement.world_from_object();
  const double volume = m_world_from_texture.determinant();
  m_texture_from_world = m_world_from_texture.inverse();
  if (!std::isnormal(volume) || !std::isnormal(m_texture_from_world.determinant())) {
    problems.emplace_back("the scale has no inverse; expected sizes between 1e-100 and 1e100");
  }
  commit_pattern(problems);
}

TextureValue Texture::at(const TexturedPoint& world) const {
  // A normal is a gradient: it goes with the transpose of the map back.
  const Vec3d n(dot(m_world_from_texture.direction({1, 0, 0}), world.n),
                dot(m_world_from_texture.direction({0, 1, 0}), world.n),
                dot(m_world_from_texture.direction({0, 0, 1}), world.n));
  TextureValue value =
      pattern({m_texture_from_world.point(world.p), normalize(n), m_texture_from_world.direction(world.a),
               m_texture_from_world.direction(world.b)});
  if (m_opacity == "luminance") value.opacity *= luminance(value.color);
  if (m_opacity == "inverse_luminance") value.opacity *= 1.0 - luminance(value.color);
  if (m_opacity == "full") value.opacity = 1.0;
  return value;
}

}  // namespace pileus
