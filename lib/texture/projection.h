#pragma once

#include "lib/math/vec.h"

namespace pileus {

/// How a picture is laid into the space of its texture, whose y axis goes up and whose unit is the picture:
///   planar       on the unit square of the xz plane around the origin, seen from above with -z at the top;
///                the same for every y
///   spherical    longitude and latitude about the origin, seen from outside; the middle faces +z
///   cylindrical  around the y axis, seen from outside, from y = 1/2 down to y = -1/2; the middle faces +z
enum class Projection { planar, spherical, cylindrical };

/// Where a point lies in a picture: u from left to right, v from top to bottom, 0 .. 1 within it.
struct PicturePlace {
  Vec2d uv;
  Vec3d du, dv;  ///< gradients of u and v in the space of the texture; finite, and huge where there are none
};

/// The place of a point of the texture's space. The seam (u = 0 and u = 1, towards -z) has no width:
/// gradients go on through it. On the axis, where every u meets, u is 1/2. errors: u and v within 4 ulp of 1
/// for finite points
PicturePlace project(Projection projection, const Vec3d& p);

}  // namespace pileus
