/// Perspective camera: a pinhole.
///
///   position   of the camera                             [m]     default [0, 0, 5]
///   look_at    point in the middle of the image          [m]     default [0, 0, 0]
///   up         direction that points up in the image     [1]     default [0, 1, 0]
///   fov_deg    horizontal field of view                  [deg]   0 < fov_deg < 180, default 40
///
///   [camera]
///   type = "perspective"
///   position = [0, 1.5, 9]
///   look_at = [0, 1.2, 0]
///
/// Directions come from differences of positions, so that a camera far from the origin sees as sharply as one
/// near it. Normalised device depth is 1 - 2 n / depth with n = 1 m: -1 at one metre, 1 at infinity.
#include <cmath>
#include <numbers>

#include "lib/scene/camera.h"
#include "shaders_cpu/camera/camera_frame.h"

namespace pileus {
namespace {

struct Perspective final : Camera {
  CameraFrame m_frame;
  double m_fov_deg = 40.0;
  double m_tan_half = 0.0;  ///< half the image's width at a distance of 1

  void describe(ParamTable& params) override {
    m_frame.describe(params);
    params.number("fov_deg", m_fov_deg, "deg", "horizontal field of view").above(0).below(180);
  }
  void commit(std::vector<std::string>& problems) override {
    m_frame.commit(problems);
    m_tan_half = std::tan(m_fov_deg / 360.0 * std::numbers::pi);
  }
  Ray ray(const Vec2d& pixel, const Vec2i& size) const override {
    const Vec2d at = m_tan_half * image_plane(pixel, size);
    return {m_frame.position, normalize(at.x * m_frame.right + at.y * m_frame.true_up - m_frame.backward)};
  }
  std::optional<Beam> beam(const Vec2d& lo, const Vec2d& hi, const Vec2i& size) const override {
    // Between the corners the way to the image plane is linear, its length convex: shortest where the
    // rectangle is nearest to the middle of the image.
    const Vec2d a = m_tan_half * image_plane(lo, size), b = m_tan_half * image_plane(hi, size);
    Box3d ways;
    double longest2 = 0.0;
    for (const Vec2d& at : {a, Vec2d(a.x, b.y), Vec2d(b.x, a.y), b}) {
      ways.extendBy(at.x * m_frame.right + at.y * m_frame.true_up - m_frame.backward);
      longest2 = std::max(longest2, 1.0 + at.length2());
    }
    const auto nearest = [](double s, double t) {
      return s * t < 0.0 ? 0.0 : std::min(std::abs(s), std::abs(t));
    };
    const Vec2d middle(nearest(a.x, b.x), nearest(a.y, b.y));
    const double longest = std::sqrt(longest2), shortest = std::sqrt(1.0 + middle.length2());
    Beam beam{Box3d(m_frame.position), ways};
    for (int axis = 0; axis < 3; ++axis) {
      beam.d.min[axis] /= ways.min[axis] < 0.0 ? shortest : longest;
      beam.d.max[axis] /= ways.max[axis] < 0.0 ? longest : shortest;
    }
    return rounded_outwards(beam);
  }
  Imath::M44d camera_from_world() const override { return m_frame.camera_from_world(); }
  Imath::M44d screen_from_world(const Vec2i& size) const override {
    const double scale_x = 1.0 / m_tan_half;
    const double scale_y = scale_x * size.x / size.y;
    const Imath::M44d screen_from_camera(scale_x, 0.0, 0.0, 0.0,  //
                                         0.0, scale_y, 0.0, 0.0,  //
                                         0.0, 0.0, -1.0, -1.0,    //
                                         0.0, 0.0, -2.0, 0.0);
    return camera_from_world() * screen_from_camera;
  }
};

}  // namespace

PILEUS_PLUGIN(Camera, perspective, Perspective, "a pinhole")

}  // namespace pileus
