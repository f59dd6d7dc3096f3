#pragma once

#include "lib/freeform/quadric.h"

namespace pileus {

// Quadrics by name. Each is 0 on its surface and positive inside; those with a middle are 1 there. `axis`
// and `normal` need no particular length, but one other than 0.

/// 1 - x² - y² - z² in units of the radii.
Quadric ellipsoid(const Vec3d& center, const Vec3d& radii);
Quadric sphere(const Vec3d& center, double radius);

/// 1 - r², endless along the axis; r in units of the radius.
Quadric cylinder(const Vec3d& center, const Vec3d& axis, double radius);

/// z² - r², both halves, endless; z is 1 at `height` along the axis, where the cone's radius is `radius`.
Quadric cone(const Vec3d& apex, const Vec3d& axis, double radius, double height);

/// z - r², endless towards the axis; z and r as in a cone.
Quadric paraboloid(const Vec3d& vertex, const Vec3d& axis, double radius, double height);

/// 1 - r² + z²: a waist of radius `radius`; at `height` the radius is sqrt(2) times that.
Quadric hyperboloid_of_one_sheet(const Vec3d& center, const Vec3d& axis, double radius, double height);

/// z² - r² - 1: two bowls that start at `height` from the centre and lie in the cone of that radius there.
Quadric hyperboloid_of_two_sheets(const Vec3d& center, const Vec3d& axis, double radius, double height);

/// -d / size, d the distance along the normal, which points outwards.
Quadric plane(const Vec3d& point, const Vec3d& normal, double size);

/// 1 - (2 d / thickness)²: the slab between two planes.
Quadric plane_pair(const Vec3d& center, const Vec3d& normal, double thickness);

/// Axes at right angles, the third along `axis`: radius, radius, height long. Directions along the axes of
/// space come out exactly.
Frame frame_along(const Vec3d& center, const Vec3d& axis, double radius, double height);

}  // namespace pileus
