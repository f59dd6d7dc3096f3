#pragma once

#include <functional>
#include <memory>
#include <string>

#include "lib/scene/medium.h"
#include "lib/scene/shape.h"

namespace pileus {

/// What a shape may be made of: the free forms and the other objects of its scene.
struct ShapeSources {
  const FreeForms& freeforms;
  std::function<std::shared_ptr<const Shape>(const std::string& name)> object;  ///< built; throws Error
};

/// A shape that is made of other things of the scene.
struct FormedShape : Shape {
  /// The shape ready to be met by rays; this one is not. Throws Error.
  virtual std::shared_ptr<const Shape> build(const ShapeSources& sources) const = 0;
};

}  // namespace pileus
