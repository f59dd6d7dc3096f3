// Which of many objects a ray meets: one after the other, by the tree, and as ShapeIndex decides.
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "lib/geom/box_index.h"
#include "lib/scene/world.h"

namespace pileus::bench {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const Segment kAll{0.0, kInfinity};
constexpr size_t kRays = 4096, kPacket = 64;

/// n objects in a cube, so small that a ray meets one or two whatever n is; and rays of a small picture of
/// it, those of one square of 8 x 8 pixels after the other.
struct Objects {
  World world;
  std::vector<Ray> rays;

  Objects(size_t n, const std::string& kind) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const double radius = std::min(0.4, (kind == "layer" ? 0.7 : 1.2) / std::sqrt(double(n)));
    const size_t side = size_t(std::ceil(std::sqrt(double(n))));
    std::string text = "pileus = 1\n[camera]\ntype = \"perspective\"\nposition = [0, 0, 5]\nfov_deg = 22\n";
    for (size_t i = 0; i < n; ++i) {
      Vec3d at(uniform(random), uniform(random), uniform(random));
      if (kind == "layer") {
        at = {2.0 * (double(i % side) + 0.5) / double(side) - 1.0,
              2.0 * (double(i / side) + 0.5) / double(side) - 1.0, 0.0};
      }
      const std::string center = fmt::format("[{:.5f}, {:.5f}, {:.5f}]", at.x, at.y, at.z);
      if (kind != "form") {
        text += fmt::format("[object.o{}]\ntype = \"sphere\"\ncenter = {}\nradius = {}\n", i, center, radius);
      } else {
        text += fmt::format(
            "[freeform.f{0}]\nbase = {{ sphere = {{ center = {1}, radius = {2} }} }}\nperturb = [{{ sphere = "
            "{{ center = {1}, "
            "radius = {3} }}, factor = 0.3 }}]\n[object.o{0}]\ntype = \"freeform\"\nform = \"f{0}\"\n",
            i, center, radius, 0.7 * radius);
      }
    }
    world = build_world(parse_scene(text, "objects", ""));
    for (size_t i = 0; i < kRays; ++i) {
      const size_t block = i / kPacket, x = block % 8 * 8 + i % 8, y = block / 8 * 8 + i % kPacket / 8;
      rays.push_back(world.camera->ray({double(x) + 0.5, double(y) + 0.5}, {64, 64}));
    }
  }
};

std::optional<double> nearest_of_all(const World& world, const Ray& ray) {
  std::optional<double> nearest;
  Segment segment = kAll;
  for (const auto& shape : world.shapes) {
    if (const auto hit = shape->intersect(ray, segment)) nearest = segment.t1 = hit->t;
  }
  return nearest;
}

std::optional<double> nearest_by_tree(const World& world, const BoxIndex& tree, const Ray& ray) {
  std::optional<double> nearest;
  tree.visit(ray, kAll, [&](size_t i, double& t1) {
    if (const auto hit = world.shapes[i]->intersect(ray, {0.0, t1})) nearest = t1 = hit->t;
    return true;
  });
  return nearest;
}

BoxIndex tree_of(const World& world) {
  std::vector<Box3d> boxes;
  for (const auto& shape : world.shapes) boxes.push_back(shape->bounds());
  return BoxIndex(boxes);
}

template <class Ask>
void for_rays(benchmark::State& state, const Objects& objects, const Ask& ask) {
  for (auto _ : state) {
    for (const Ray& ray : objects.rays) benchmark::DoNotOptimize(ask(ray));
  }
  state.SetItemsProcessed(state.iterations() * int64_t(kRays));
}

void loop(benchmark::State& state, const std::string& kind) {
  const Objects objects(size_t(state.range(0)), kind);
  for_rays(state, objects, [&](const Ray& ray) { return nearest_of_all(objects.world, ray); });
}

void tree(benchmark::State& state, const std::string& kind) {
  const Objects objects(size_t(state.range(0)), kind);
  const BoxIndex index = tree_of(objects.world);
  for_rays(state, objects, [&](const Ray& ray) { return nearest_by_tree(objects.world, index, ray); });
}

void index(benchmark::State& state, const std::string& kind) {
  const Objects objects(size_t(state.range(0)), kind);
  for_rays(state, objects, [&](const Ray& ray) { return nearest_surface(objects.world, ray, kAll); });
}

/// Sixty-four rays at a time, which free forms meet together where they are asked one after the other.
void packets(benchmark::State& state, const std::string& kind) {
  const Objects objects(size_t(state.range(0)), kind);
  std::vector<const Shape*> shapes;
  for (const auto& shape : objects.world.shapes) shapes.push_back(shape.get());
  const std::vector<RaySight> seen(kPacket);
  std::vector<Segment> segments(kPacket);
  std::vector<std::optional<SurfaceHit>> hits(kPacket);
  for (auto _ : state) {
    for (size_t first = 0; first < kRays; first += kPacket) {
      const std::span<const Ray> rays = std::span(objects.rays).subspan(first, kPacket);
      std::fill(segments.begin(), segments.end(), kAll);
      for (const Shape* shape : shapes) {
        shape->intersect_all(rays, segments, seen, hits);
        for (size_t i = 0; i < kPacket; ++i) {
          if (hits[i]) segments[i].t1 = hits[i]->t;
        }
      }
      benchmark::DoNotOptimize(segments.data());
    }
  }
  state.SetItemsProcessed(state.iterations() * int64_t(kRays));
}

void few(benchmark::internal::Benchmark* benchmark) {
  for (const int n : {1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 16, 24, 32, 64}) benchmark->Arg(n);
}

BENCHMARK_CAPTURE(loop, sphere, "sphere")->Name("index/spheres/loop")->ArgName("n")->Apply(few);
BENCHMARK_CAPTURE(tree, sphere, "sphere")->Name("index/spheres/tree")->ArgName("n")->Apply(few);
BENCHMARK_CAPTURE(loop, form, "form")->Name("index/forms/loop")->ArgName("n")->Apply(few);
BENCHMARK_CAPTURE(packets, form, "form")->Name("index/forms/packets")->ArgName("n")->Apply(few);
BENCHMARK_CAPTURE(tree, form, "form")->Name("index/forms/tree")->ArgName("n")->Apply(few);
void many(benchmark::internal::Benchmark* benchmark) {
  for (const int n : {1, 10, 100, 1000, 10000, 100000}) benchmark->Arg(n);
}

BENCHMARK_CAPTURE(index, layer, "layer")->Name("index/layer/nearest")->ArgName("n")->Apply(many);
BENCHMARK_CAPTURE(index, sphere, "sphere")->Name("index/spheres/nearest")->ArgName("n")->Apply(many);

}  // namespace
}  // namespace pileus::bench
