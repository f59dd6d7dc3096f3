/// Orthographic camera: parallel rays, no foreshortening.
///
///   position   middle of the image plane, where rays start   [m]   default [0, 0, 5]
///   look_at    point in the middle of the image              [m]   default [0, 0, 0]
///   up         direction that points up in the image         [1]   default [0, 1, 0]
///   width      of the image plane                            [m]   > 0, default 2
///
///   [camera]
///   type = "orthographic"
///   position = [0, 1, 9]
///   look_at = [0, 1, 0]
///   width = 6
///
/// What lies behind the image plane is not seen. Normalised device depth is the distance from it in metres.
#include "lib/scene/camera.h"
#include "shaders_cpu/camera/camera_frame.h"

namespace pileus {
namespace {

struct Orthographic final : Camera {
  CameraFrame m_frame;
  double m_width = 2.0;

  void describe(ParamTable& params) override {
    m_frame.describe(params);
    params.number("width", m_width, "m", "of the image plane").above(0);
  }
  void commit(std::vector<std::string>& problems) override { m_frame.commit(problems); }
  Ray ray(const Vec2d& pixel, const Vec2i& size) const override {
    const Vec2d at = 0.5 * m_width * image_plane(pixel, size);
    return {m_frame.position + (at.x * m_frame.right + at.y * m_frame.true_up), -m_frame.backward};
  }
  std::optional<Beam> beam(const Vec2d& lo, const Vec2d& hi, const Vec2i& size) const override {
    const Ray corners[] = {ray(lo, size), ray({lo.x, hi.y}, size), ray({hi.x, lo.y}, size), ray(hi, size)};
    Beam beam{Box3d(corners[0].o), Box3d(corners[0].d)};
    for (const Ray& corner : corners) beam.o.extendBy(corner.o);
    return rounded_outwards(beam);
  }
  Imath::M44d camera_from_world() const override { return m_frame.camera_from_world(); }
  Imath::M44d screen_from_world(const Vec2i& size) const override {
    const double scale_x = 2.0 / m_width;
    const double scale_y = scale_x * size.x / size.y;
    return camera_from_world() * Imath::M44d().setScale(Vec3d(scale_x, scale_y, -1.0));
  }
};

}  // namespace

PILEUS_PLUGIN(Camera, orthographic, Orthographic, "parallel rays")

}  // namespace pileus
