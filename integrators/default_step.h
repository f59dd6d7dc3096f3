#pragma once

namespace pileus {

struct World;

/// The step of an equidistant marcher that is told none [m]: half the smallest feature of the media, or 1/256
/// of the smallest medium where nothing has features; infinite where there is no medium.
double default_step(const World& world);

}  // namespace pileus
