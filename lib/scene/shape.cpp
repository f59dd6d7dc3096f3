#include "lib/scene/shape.h"

#include "lib/core/param_table.h"

namespace pileus {

void Shape::describe(ParamTable& params) {
  describe_form(params);
  params.plugin<SurfaceShader>("shader", shader, "phong", "what light does on the surface");
}

}  // namespace pileus
