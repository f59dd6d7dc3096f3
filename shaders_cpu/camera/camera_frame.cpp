#include "shaders_cpu/camera/camera_frame.h"

#include "lib/math/unit_vector.h"

namespace pileus {
namespace {

/// Sine of the angle between up and the view below which the frame would lose half its digits.
constexpr double kLeastSine = 1e-8;

}  // namespace

void CameraFrame::describe(ParamTable& params) {
  params.vector("position", position, "m", "of the camera");
  params.vector("look_at", look_at, "m", "point in the middle of the image");
  params.vector("up", up, "", "direction that points up in the image");
}

void CameraFrame::commit(std::vector<std::string>& problems) {
  const auto away = unit_vector(position - look_at);
  const auto upwards = unit_vector(up);
  if (!away)
    problems.push_back("look_at equals position, or one is not finite; expected two different points");
  if (!upwards) problems.push_back("up is zero or not finite; expected a direction");
  if (!away || !upwards) return;

  const Vec3d sideways = cross(*upwards, *away);
  if (!(length(sideways) > kLeastSine)) {
    problems.push_back("up is parallel to the view direction; expected any other direction");
    return;
  }
  backward = *away;
  right = normalize(sideways);
  true_up = cross(backward, right);
}

Imath::M44d CameraFrame::camera_from_world() const {
  const Vec3d& x = right;
  const Vec3d& y = true_up;
  const Vec3d& z = backward;
  return Imath::M44d(x.x, y.x, z.x, 0.0,  //
                     x.y, y.y, z.y, 0.0,  //
                     x.z, y.z, z.z, 0.0,  //
                     -dot(position, x), -dot(position, y), -dot(position, z), 1.0);
}

}  // namespace pileus
