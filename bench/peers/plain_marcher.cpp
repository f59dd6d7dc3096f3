/// The bar: a brute-force marcher as a good programmer writes it in an afternoon, and no more.
///
/// Dense float grid, trilinear look-ups, equal steps with midpoint samples, a shadow ray per lit sample with
/// the same step, blocks of 8^3 empty cells skipped, rays stopped where nothing can be seen or no light
/// arrives, rows spread over threads. One sun, isotropic phase function, albedo 1, black background. It
/// shares nothing with pileus but the readers of scenes and `.vdb` files and the camera, so that it can serve
/// as a second opinion too (--double, a short --step, a small --stop).
///
///   plain_marcher bench/peers/scene.toml -o cloud.npy --step 1
///
/// Prints one line of JSON with the seconds of each stage.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <getopt.h>

#include "bench/peers/dense_grid.h"
#include "bench/peers/npy.h"
#include "lib/core/error.h"
#include "pileus/pileus.h"

namespace pileus::bench {
namespace {

using Clock = std::chrono::steady_clock;

struct MarchScene {
  std::shared_ptr<const Camera> camera;
  Vec2i size;               ///< of the picture [pixels]
  Vec3d sun;                ///< towards it
  double irradiance = 0.0;  ///< of the sun
  double extinction = 0.0;  ///< [1/m]
  std::filesystem::path cloud;
};

struct MarchOptions {
  std::string scene, output;
  double step = 1.0;   ///< [voxels]
  double stop = 1e-3;  ///< transmittance at which rays end
  int threads = 2;
  bool is_double = false;
};

template <class Real>
struct Vec {
  Real x, y, z;
};

template <class Real>
Vec<Real> narrow(const Vec3d& v) {
  return {Real(v.x), Real(v.y), Real(v.z)};
}

/// What rays read. All positions in voxels of the grid.
template <class Real>
class Marcher {
 public:
  Marcher(const DenseGrid& grid, const MarchScene& scene, const MarchOptions& options)
      : m_rho(grid.rho.data()),
        m_lit(grid.lit.data()),
        m_stride_y(grid.size.x),
        m_stride_z(ptrdiff_t(grid.size.x) * grid.size.y),
        m_block_stride_y(grid.blocks.x),
        m_block_stride_z(ptrdiff_t(grid.blocks.x) * grid.blocks.y),
        m_top{Real(grid.size.x - 2), Real(grid.size.y - 2), Real(grid.size.z - 2)},
        m_step(Real(options.step)),
        m_tau_step(Real(scene.extinction * grid.voxel_size * options.step)),
        m_tau_stop(Real(-std::log(options.stop))),
        m_stop(Real(options.stop)),
        m_sun(narrow<Real>(normalize(scene.sun))),
        m_source(Real(scene.irradiance * 0.25 * std::numbers::inv_pi)) {}

  /// Radiance along a ray.
  Real radiance(const Vec<Real>& o, const Vec<Real>& d) const {
    Real sum = 0, visible = 1;
    walk(o, d, [&](const Vec<Real>& p, Real rho) {
      const Real passed = std::exp(-m_tau_step * rho);
      sum += visible * (Real(1) - passed) * sunlight(p);
      visible *= passed;
      return visible > m_stop;
    });
    return sum * m_source;
  }

 private:
  /// Share of the sunlight that arrives at p.
  Real sunlight(const Vec<Real>& p) const {
    Real tau = 0;
    walk(p, m_sun, [&](const Vec<Real>&, Real rho) {
      tau += m_tau_step * rho;
      return tau < m_tau_stop;
    });
    return std::exp(-tau);
  }

  /// Calls visit(p, rho) at the middle of every step with rho > 0, from o or the grid's box on, until it
  /// leaves the box or visit says false.
  template <class Visit>
  void walk(const Vec<Real>& o, const Vec<Real>& d, Visit&& visit) const {
    Real t0 = 0, t1 = std::numeric_limits<Real>::max();
    const Vec<Real> inverse{Real(1) / d.x, Real(1) / d.y, Real(1) / d.z};
    clip(o.x, inverse.x, m_top.x, t0, t1);
    clip(o.y, inverse.y, m_top.y, t0, t1);
    clip(o.z, inverse.z, m_top.z, t0, t1);
    const Real per_step = Real(1) / m_step;
    const int steps = t1 > t0 ? int((t1 - t0) * per_step + Real(0.5)) : 0;
    for (int i = 0; i < steps;) {
      const Real t = t0 + (Real(i) + Real(0.5)) * m_step;
      const Vec<Real> p{o.x + t * d.x, o.y + t * d.y, o.z + t * d.z};
      const unsigned x = unsigned(int(p.x)), y = unsigned(int(p.y)), z = unsigned(int(p.z));
      if (!m_lit[(z / kBlock) * m_block_stride_z + (y / kBlock) * m_block_stride_y + x / kBlock]) {
        const Real leave =
            std::min({exit(p.x, inverse.x, x), exit(p.y, inverse.y, y), exit(p.z, inverse.z, z)});
        i += 1 + int(leave * per_step);
        continue;
      }
      ++i;
      const Real rho = density(p, x, y, z);
      if (rho > 0 && !visit(p, rho)) return;
    }
  }

  static void clip(Real o, Real inverse, Real top, Real& t0, Real& t1) {
    const Real a = -o * inverse, b = (top - o) * inverse;
    t0 = std::max(t0, std::min(a, b));
    t1 = std::min(t1, std::max(a, b));
  }

  /// Distance to where the ray leaves the block of cell x along one axis; infinite where it runs along it.
  static Real exit(Real p, Real inverse, unsigned x) {
    const unsigned first = x / kBlock * kBlock;
    const Real face = inverse > 0 ? Real(int(first + kBlock)) : Real(int(first));
    return std::max(Real(0), (face - p) * inverse);
  }

  Real density(const Vec<Real>& p, unsigned x, unsigned y, unsigned z) const {
    const float* c = m_rho + z * m_stride_z + y * m_stride_y + x;
    const Real u = p.x - Real(int(x)), v = p.y - Real(int(y)), w = p.z - Real(int(z));
    const auto lerp = [](Real a, Real b, Real s) { return a + s * (b - a); };
    const auto row = [&](const float* r) { return lerp(Real(r[0]), Real(r[1]), u); };
    const Real near = lerp(row(c), row(c + m_stride_y), v);
    const Real far = lerp(row(c + m_stride_z), row(c + m_stride_z + m_stride_y), v);
    return lerp(near, far, w);
  }

  static constexpr unsigned kBlock = DenseGrid::kBlock;

  const float* m_rho;
  const uint8_t* m_lit;
  ptrdiff_t m_stride_y, m_stride_z, m_block_stride_y, m_block_stride_z;
  Vec<Real> m_top;  ///< far corner of the box that rays walk; cells beyond it exist, so rounding does no harm
  Real m_step, m_tau_step, m_tau_stop, m_stop;
  Vec<Real> m_sun;
  Real m_source;  ///< radiance scattered from a point in full light, per unit of optical depth
};

/// One ray through the middle of each pixel, row by row from the top.
template <class Real>
std::vector<float> render(const DenseGrid& grid, const MarchScene& scene, const MarchOptions& options) {
  const Marcher<Real> marcher(grid, scene, options);
  std::vector<float> pixels(size_t(scene.size.x) * size_t(scene.size.y));
  std::atomic<int> next_row{0};
  const auto work = [&] {
    for (int row; (row = next_row++) < scene.size.y;) {
      for (int column = 0; column < scene.size.x; ++column) {
        const Ray ray = scene.camera->ray(Vec2d(column + 0.5, row + 0.5), scene.size);
        const Vec3d o = (ray.o - grid.origin) / grid.voxel_size;
        pixels[size_t(row) * size_t(scene.size.x) + size_t(column)] =
            float(marcher.radiance(narrow<Real>(o), narrow<Real>(ray.d)));
      }
    }
  };
  std::vector<std::jthread> others;
  for (int i = 1; i < options.threads; ++i) others.emplace_back(work);
  work();
  others.clear();  // joins them
  return pixels;
}

[[noreturn]] void refuse(const std::string& what) {
  throw Error(ErrorKind::usage, SourceLoc{}, what);
}

MarchScene read_scene(const std::string& file) {
  const Scene scene = load(file);
  if (scene.volumes.size() != 1 || scene.lights.size() != 1 || scene.files.size() != 1 ||
      !scene.objects.empty() || !scene.lights[0].object->is_directional() ||
      !scene.volumes[0].object->phase->is_isotropic()) {
    refuse(file + ": expected one sun and one volume of type vdb with an isotropic phase function, no more");
  }
  const Illumination sun = scene.lights[0].object->at(Vec3d(0.0));
  return {scene.camera,  scene.render.size, sun.wi, sun.irradiance.x, scene.volumes[0].object->extinction,
          scene.files[0]};
}

double positive(const char* text) {
  const double value = std::atof(text);
  if (!(value > 0.0)) refuse(std::string(text) + " is no positive number");
  return value;
}

MarchOptions read_options(int argc, char** argv) {
  const option names[] = {
      {"output", required_argument, nullptr, 'o'},  {"step", required_argument, nullptr, 's'},
      {"stop", required_argument, nullptr, 'e'},    {"double", no_argument, nullptr, 'd'},
      {"threads", required_argument, nullptr, 't'}, {}};
  MarchOptions options;
  for (int name; (name = getopt_long(argc, argv, "o:", names, nullptr)) != -1;) {
    switch (name) {
      case 'o':
        options.output = optarg;
        break;
      case 's':
        options.step = positive(optarg);
        break;
      case 'e':
        options.stop = positive(optarg);
        break;
      case 'd':
        options.is_double = true;
        break;
      case 't':
        options.threads = int(positive(optarg));
        break;
      default:
        refuse(
            "usage: plain_marcher SCENE.toml [-o PIXELS.npy] [--step VOXELS] [--stop T] [--double] "
            "[--threads N]");
    }
  }
  if (optind + 1 != argc) refuse("expected one scene");
  options.scene = argv[optind];
  return options;
}

class Stopwatch {
 public:
  /// Seconds since the last call.
  double lap() {
    const Clock::time_point now = Clock::now();
    return std::chrono::duration<double>(now - std::exchange(m_last, now)).count();
  }

 private:
  Clock::time_point m_last = Clock::now();
};

void run(const MarchOptions& options) {
  Stopwatch watch, whole;
  const MarchScene scene = read_scene(options.scene);
  DenseGrid grid = read_dense_grid(scene.cloud);
  const double load = watch.lap();
  find_lit_blocks(grid);
  const double build = watch.lap();
  const std::vector<float> pixels =
      options.is_double ? render<double>(grid, scene, options) : render<float>(grid, scene, options);
  const double rendering = watch.lap();
  if (!options.output.empty()) write_npy(options.output, pixels, {scene.size.y, scene.size.x});
  std::printf("{\"load\": %.4f, \"build\": %.4f, \"render\": %.4f, \"total\": %.4f}\n", load, build,
              rendering, whole.lap());
}

}  // namespace
}  // namespace pileus::bench

int main(int argc, char** argv) try {
  pileus::bench::run(pileus::bench::read_options(argc, argv));
} catch (const std::exception& error) {
  std::fprintf(stderr, "plain_marcher: %s\n", error.what());
  return 1;
}
