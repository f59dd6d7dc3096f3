#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "lib/math/ray.h"
#include "lib/scene/light.h"
#include "lib/scene/shape.h"

namespace pileus {

/// Appends where along a segment of a ray the light that passes a shape with holes jumps, by a tenth of it or
/// more: looked for at 65 equal distances in what the shape may shade, then halved. Pieces of light or shadow
/// that are shorter than a distance may be missed; smaller jumps are left to the quadrature.
///   finest: length to which an edge is found [m]
///   lookups: counts textures that were looked up
/// Returns how many were found.
size_t append_hole_edges(const Shape& shape, const Ray& ray, Segment segment, const Light& light,
                         double finest, std::vector<double>& edges, uint64_t& lookups);

}  // namespace pileus
