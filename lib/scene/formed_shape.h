#pragma once

#include <memory>

#include "lib/scene/medium.h"
#include "lib/scene/shape.h"

namespace pileus {

/// A shape that is made of free forms of the scene.
struct FormedShape : Shape {
  /// The shape ready to be met by rays; this one is not. Throws Error.
  virtual std::shared_ptr<const Shape> build(const FreeForms& freeforms) const = 0;
};

}  // namespace pileus
