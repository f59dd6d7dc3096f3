#include "lib/scene/surface_shader.h"

#include "lib/core/param_table.h"
#include "lib/scene/texture.h"

namespace pileus {

void SurfaceShader::describe(ParamTable& params) {
  describe_surface(params);
  params.object("texture", texture, "colour, by which diffuse and ambient reflectance are multiplied");
  params.object("opacity_texture", opacity_texture, "where the surface is; that of `texture` counts, too");
}

bool SurfaceShader::has_holes() const {
  return (texture && !texture->is_opaque()) || (opacity_texture && !opacity_texture->is_opaque());
}

double SurfaceShader::opacity_at(const TexturedPoint& point) const {
  const double own = texture ? texture->at(point).opacity : 1.0;
  return opacity_texture ? own * opacity_texture->at(point).opacity : own;
}

}  // namespace pileus
