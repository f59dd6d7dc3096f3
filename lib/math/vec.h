#pragma once

#include <ImathBox.h>
#include <ImathMatrix.h>
#include <ImathVec.h>

namespace pileus {

using Vec2d = Imath::V2d;
using Vec2i = Imath::V2i;
using Vec3d = Imath::V3d;
using Vec3f = Imath::V3f;
using Vec3i = Imath::V3i;
using Box3d = Imath::Box3d;
using Box3i = Imath::Box3i;

/// Linear RGB: radiance, a reflectance or an albedo. Operators work channel by channel.
using Rgb = Imath::V3d;

inline double dot(const Vec3d& a, const Vec3d& b) {
  return a.dot(b);
}
inline Vec3d cross(const Vec3d& a, const Vec3d& b) {
  return a.cross(b);
}
inline double length(const Vec3d& a) {
  return a.length();
}
inline Vec3d normalize(const Vec3d& a) {
  return a.normalized();
}

}  // namespace pileus
