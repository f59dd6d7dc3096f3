#pragma once

#include <array>

#include "lib/image/plane.h"

namespace pileus {

/// Linear RGB of a display picture, each value in [0, 1].
using RgbPlanes = std::array<Plane, 3>;

/// A screen of 3840 pixels over 0.7 m, seen from 0.7 m: 67.02 pixels per degree, the published default.
inline constexpr double kDefaultPixelsPerDegree = 3840.0 * 3.14159265358979323846 / 180.0;

/// The difference that an observer sees between two pictures of equal size when they alternate, per pixel: 0
/// none, 1 the largest. This is the FLIP of display pictures (not HDR-FLIP); beyond the border, pictures go
/// on with their nearest pixel. Pooled by mean(), it is the FLIP value of the two. ref: andersson2020 (FLIP:
/// a difference evaluator for alternating images)
Plane flip_map(RgbPlanes test, RgbPlanes reference, double pixels_per_degree = kDefaultPixelsPerDegree);

}  // namespace pileus
