// What a solid of free form takes in memory, against triangle meshes of it: how fine these must be for the
// same outline and depths in a picture, and what they take then.
//
//   build/release/bin/bench_aircraft_bytes                     meshes of equal edges, ever finer
//   build/release/bin/bench_aircraft_bytes write 0.02 a.ply    one of them
//   build/release/bin/bench_aircraft_bytes compare b.ply ...   others
#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "bench/forms/form_mesh.h"
#include "lib/core/error.h"
#include "lib/core/parallel.h"
#include "lib/freeform/form_program.h"
#include "lib/freeform/form_tracer.h"
#include "lib/geom/mesh_file.h"
#include "lib/scene/world.h"

namespace pileus::bench {
namespace {

/// A mesh as an object meets rays.
struct MeshSolid final : Shape {
  TriangleMesh mesh;

  explicit MeshSolid(MeshData data) : mesh(std::move(data)) {}
  void describe_form(ParamTable&) override {}
  std::optional<SurfaceHit> intersect(const Ray& ray, Segment segment) const override {
    const auto hit = mesh.intersect(ray, segment);
    return hit ? std::optional(SurfaceHit{hit->t, hit->face_normal, hit->error, hit->is_inside})
               : std::nullopt;
  }
  Box3d bounds() const override { return mesh.bounds(); }
};

const Vec2i kPicture(640, 360);
constexpr int kFiner = 4;  ///< rays per pixel and axis, where outlines are compared

/// Allocated, with what the allocator rounds up.
int64_t live_bytes() {
  return int64_t(mallinfo2().uordblks);
}

/// Forms and what tracers make of them.
struct FormBytes {
  int64_t form = 0, traced = 0;
};

FormBytes bytes_of(const FreeForm& form) {
  const int64_t before = live_bytes();
  const FreeForm copy{FormProgram(form.program())};
  const int64_t with_form = live_bytes();
  const FormTracer tracer(copy);
  return {with_form - before, live_bytes() - before};
}

/// Depths along the rays of a picture; infinite beside the solid.
using Depths = std::vector<float>;

Depths depths_of(const World& world) {
  const Vec2i size = kFiner * kPicture;
  Depths depths(size_t(size.x) * size_t(size.y));
  parallel_for(size_t(size.y), [&](size_t y) {
    constexpr size_t kPacket = 64;
    std::vector<Ray> rays(kPacket);
    std::vector<std::optional<WorldHit>> hits(kPacket);
    for (size_t x = 0; x < size_t(size.x); x += kPacket) {
      for (size_t i = 0; i < kPacket; ++i)
        rays[i] = world.camera->ray({double(x + i) + 0.5, double(y) + 0.5}, size);
      nearest_surfaces(world, rays, {}, {}, hits);
      for (size_t i = 0; i < kPacket; ++i) {
        depths[y * size_t(size.x) + x + i] =
            hits[i] ? float(hits[i]->t) : std::numeric_limits<float>::infinity();
      }
    }
  });
  return depths;
}

struct Errors {
  double worst_outline = 0.0;  ///< [pixels of the picture], to 1 / kFiner
  double mean_outline = 0.0;   ///< [pixels], over the outline
  double median_depth = 0.0,
         high_depth = 0.0;  ///< [pixels], where both are seen; the second of one in a hundred
};

/// How far a fine pixel lies from the nearest one that is, in the true picture, on the other side of the
/// outline.
double distance_to_other_side(const Depths& truth, int x, int y) {
  constexpr int kReach = 40;
  const Vec2i size = kFiner * kPicture;
  const auto is_solid = [&](int i, int j) {
    return std::isfinite(truth[size_t(j) * size_t(size.x) + size_t(i)]);
  };
  const bool here = is_solid(x, y);
  int nearest2 = kReach * kReach;
  for (int j = std::max(0, y - kReach); j <= std::min(size.y - 1, y + kReach); ++j) {
    for (int i = std::max(0, x - kReach); i <= std::min(size.x - 1, x + kReach); ++i) {
      if (is_solid(i, j) != here) nearest2 = std::min(nearest2, (i - x) * (i - x) + (j - y) * (j - y));
    }
  }
  return std::sqrt(double(nearest2));
}

Errors compare(const Depths& truth, const Depths& mesh, double pixel_per_metre_at_1) {
  const Vec2i size = kFiner * kPicture;
  Errors errors;
  int64_t differ = 0, outline = 0;
  std::vector<double> depth_errors;
  for (int y = 0; y < size.y; ++y) {
    for (int x = 0; x < size.x; ++x) {
      const size_t i = size_t(y) * size_t(size.x) + size_t(x);
      const bool in_truth = std::isfinite(truth[i]), in_mesh = std::isfinite(mesh[i]);
      if (x > 0 && in_truth != std::isfinite(truth[i - 1])) ++outline;
      if (y > 0 && in_truth != std::isfinite(truth[i - size_t(size.x)])) ++outline;
      if (in_truth && in_mesh)
        depth_errors.push_back(std::abs(double(truth[i]) - double(mesh[i])) * pixel_per_metre_at_1 /
                               double(truth[i]));
      if (in_truth == in_mesh) continue;
      ++differ;
      errors.worst_outline = std::max(errors.worst_outline, distance_to_other_side(truth, x, y) / kFiner);
    }
  }
  errors.mean_outline = double(differ) / double(std::max<int64_t>(outline, 1)) / kFiner;
  const auto share = [&](double of) {
    const auto nth = depth_errors.begin() + std::ptrdiff_t(of * double(depth_errors.size() - 1));
    std::nth_element(depth_errors.begin(), nth, depth_errors.end());
    return *nth;
  };
  if (!depth_errors.empty()) errors.median_depth = share(0.5), errors.high_depth = share(0.99);
  return errors;
}

std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// Without comments and blank lines: what the forms themselves take.
size_t form_text_bytes(const std::string& scene) {
  std::istringstream lines(scene);
  size_t bytes = 0;
  bool in_form = false;
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && line.front() == '[') in_form = line.rfind("[freeform.", 0) == 0;
    const std::string used = line.substr(0, line.find('#'));
    if (in_form && !used.empty()) bytes += used.size() + 1;
  }
  return bytes;
}

const std::filesystem::path kScene = "samples/scenes/aircraft.toml";

void print_head() {
  fmt::print(
      "| mesh | triangles | mesh [bytes] | mesh / form | outline: worst [px] | mean [px] | "
      "depth: median [px] | 99 % [px] |\n| --- | --- | --- | --- | --- | --- | --- | --- |\n");
}

/// The aircraft without its propellers, and what meshes of it are compared with.
class Aircraft {
 public:
  Aircraft()
      : m_scene(load_scene(kScene)), m_form(m_scene.freeforms.at("aircraft")), m_bytes(bytes_of(m_form)) {
    std::erase_if(m_scene.objects, [](const Named<Shape>& object) { return object.name != "aircraft"; });
    m_truth = depths_of(build_world(m_scene));
    const auto direction = [&](double x) {
      return m_scene.camera->ray(0.5 * Vec2d(kPicture) + Vec2d(x, 0.0), kPicture).d;
    };
    m_pixels_per_radian = 1.0 / length(direction(1.0) - direction(0.0));
    fmt::print(
        "form: {} bytes in memory, {} with what is made ready for rays; all forms of the scene: {} bytes of "
        "text\n\n",
        m_bytes.form, m_bytes.traced, form_text_bytes(text_of(kScene)));
  }

  const FreeForm& form() const { return m_form; }

  /// Returns the worst error of the outline [pixels].
  double print_row(const std::string& name, MeshData mesh) const {
    const size_t triangles = mesh.triangles.size();
    const size_t bytes = mesh.vertices.size() * sizeof(Vec3f) + triangles * sizeof(mesh.triangles[0]);
    World world;
    world.camera = m_scene.camera;
    world.shapes.push_back(std::make_shared<MeshSolid>(std::move(mesh)));
    const Errors errors = compare(m_truth, depths_of(world), m_pixels_per_radian);
    fmt::print("| {} | {} | {} | {:.0f} | {:.2f} | {:.4f} | {:.4f} | {:.3f} |\n", name, triangles, bytes,
               double(bytes) / double(m_bytes.form), errors.worst_outline, errors.mean_outline,
               errors.median_depth, errors.high_depth);
    std::fflush(stdout);
    return errors.worst_outline;
  }

 private:
  Scene m_scene;
  FreeForm m_form;
  FormBytes m_bytes;
  Depths m_truth;
  double m_pixels_per_radian = 0.0;
};

/// Ever finer meshes of equal edges, until the outline is right to half a pixel.
void compare_even_meshes() {
  constexpr double kFinest = 0.009, kEnough = 0.5;  // [m]; [pixels]
  const Aircraft aircraft;
  print_head();
  double worst = kEnough + 1.0;
  for (double edge = 0.32; edge > kFinest && worst > kEnough; edge *= 0.5)
    worst = aircraft.print_row(fmt::format("edges of {:.3g} m", edge), mesh_of(aircraft.form(), edge));
}

void compare_files(std::span<char* const> files) {
  const Aircraft aircraft;
  print_head();
  for (const char* file : files) aircraft.print_row(std::filesystem::path(file).stem(), read_mesh(file));
}

void write_mesh(double edge, const std::filesystem::path& file) {
  const MeshData mesh = mesh_of(load_scene(kScene).freeforms.at("aircraft"), edge);
  std::ofstream stream(file, std::ios::binary);
  stream << fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty "
      "float z\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      mesh.vertices.size(), mesh.triangles.size());
  const auto put = [&](const auto& value) {
    stream.write(reinterpret_cast<const char*>(&value), std::streamsize(sizeof(value)));
  };
  for (const Vec3f& vertex : mesh.vertices) put(vertex);
  for (const auto& triangle : mesh.triangles) {
    stream.put(3);
    put(triangle);
  }
}

}  // namespace
}  // namespace pileus::bench

int main(int argc, char** argv) try {
  const std::span<char* const> arguments(argv, size_t(argc));
  const std::string command = argc > 1 ? argv[1] : "";
  if (command == "write" && argc == 4) {
    pileus::bench::write_mesh(std::atof(argv[2]), argv[3]);
  } else if (command == "compare" && argc > 2) {
    pileus::bench::compare_files(arguments.subspan(2));
  } else {
    pileus::bench::compare_even_meshes();
  }
} catch (const pileus::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
