#pragma once

#include "lib/fog/fading.h"
#include "lib/scene/fog_model.h"

namespace pileus {

/// Fog that fades by distance alone: where a world has no other, it need not be cut into pieces.
struct FadingFog : FogModel {
  Fading fading;
};

}  // namespace pileus
