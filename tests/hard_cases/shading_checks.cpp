#include "lib/math/specular.h"
#include "lib/scene/camera.h"
#include "lib/scene/surface_shader.h"
#include "tests/hard_cases/hard_cases.h"
#include "tests/shaders_cpu/make_plugin.h"

namespace pileus::hard_cases {

void add_shading_checks(Checks& checks) {
  checks.add({"SHD-01"}, []<class T>(T, const HardCase& row) {
    expect_values<T>(row, {specular_power(row.input<T>("delta"), row.input<T>("n"))});
  });
  checks.add({"SHD-02"}, []<class T>(T, const HardCase& row) {
    // With the light right behind, no visible side of a surface shows a highlight.
    for (const char* name : {"phong", "blinn_phong"}) {
      const auto surface = make_plugin<SurfaceShader>(name, {{"diffuse", Rgb(0.0)}, {"specular", Rgb(1.0)}});
      const std::vector<double> l = row.inputs<double>("L"), v = row.inputs<double>("V");
      const Illumination light{{l[0], l[1], l[2]}, 1.0, Rgb(1.0)};
      for (const Vec3d& n : {Vec3d(0, 0, -1), Vec3d(1, 0, 0), Vec3d(0, 1, 0), Vec3d(0.6, 0, -0.8)}) {
        EXPECT_EQ(surface->shade({Vec3d(0.0), n}, {v[0], v[1], v[2]}, {&light, 1}),
                  Rgb(double(row.expected("specular"))));
      }
    }
  });
  checks.add({"PRJ-04"}, []<class T>(T, const HardCase& row) {
    const auto camera = make_plugin<Camera>(
        "perspective", {{"position", Vec3d(0.0)}, {"look_at", Vec3d(0, 0, -1)}, {"fov_deg", 90.0}});
    const Ray corner = camera->ray({0.0, 0.0}, {64, 64});
    const long double expected = row.expected<T>()[0];
    EXPECT_NEAR(1.0 / -corner.d.z, expected, row.tolerance<T>(expected)) << "path length per unit of depth";
  });
}

}  // namespace pileus::hard_cases
