#include "lib/scene/world.h"

#include <algorithm>

#include "lib/core/error.h"

namespace pileus {
namespace {

std::shared_ptr<const DensityField> build_density(const Named<Medium>& volume, const FreeForms& freeforms) {
  try {
    return volume.object->build(freeforms);
  } catch (const Error& error) {
    std::vector<Diagnostic> diagnostics = error.diagnostics();
    for (Diagnostic& diagnostic : diagnostics) {
      diagnostic.message = fmt::format("volume \"{}\": {}", volume.name, diagnostic.message);
    }
    throw Error(error.kind(), std::move(diagnostics));
  }
}

}  // namespace

World build_world(const Scene& scene) {
  World world;
  for (const Named<Medium>& volume : scene.volumes) {
    const Medium& medium = *volume.object;
    const bool is_visible = medium.extinction > 0.0 || medium.emission != Rgb(0.0);
    if (!is_visible) continue;  // neither loaded nor built: the effect plan says so
    const auto density = build_density(volume, scene.freeforms);
    world.media.push_back({volume.name, density, medium.extinction, medium.albedo, medium.emission,
                           medium.phase, scatter_terms(medium.multiple_scattering, medium.powder),
                           ambient_light(medium.ambient, *density, volume.name)});
  }
  for (const Named<Light>& light : scene.lights) world.lights.push_back(light.object);
  for (const Named<Shape>& object : scene.objects) world.shapes.push_back(object.object);
  world.background = scene.background;
  world.camera = scene.camera;
  return world;
}

std::optional<WorldHit> nearest_surface(const World& world, const Ray& ray, Segment segment) {
  std::optional<WorldHit> nearest;
  for (const auto& shape : world.shapes) {
    if (const auto hit = shape->intersect(ray, segment)) {
      nearest = WorldHit{hit->t, hit->n, hit->error, shape.get()};
      segment.t1 = hit->t;
    }
  }
  return nearest;
}

bool is_occluded(const World& world, const Ray& ray, Segment segment) {
  return std::any_of(world.shapes.begin(), world.shapes.end(),
                     [&](const auto& shape) { return shape->intersect(ray, segment).has_value(); });
}

}  // namespace pileus
