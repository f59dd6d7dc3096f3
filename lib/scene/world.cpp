#include "lib/scene/world.h"

#include <algorithm>
#include <utility>

#include "lib/core/error.h"
#include "lib/scene/formed_shape.h"

namespace pileus {
namespace {

/// Calls body; an error that it throws gets the name of the volume or object.
template <class Body>
auto named_errors(const char* kind, const std::string& name, Body&& body) {
  try {
    return body();
  } catch (const Error& error) {
    std::vector<Diagnostic> diagnostics = error.diagnostics();
    for (Diagnostic& diagnostic : diagnostics) {
      diagnostic.message = fmt::format("{} \"{}\": {}", kind, name, diagnostic.message);
    }
    throw Error(error.kind(), std::move(diagnostics));
  }
}

/// Neither loaded nor built otherwise: the effect plan says so.
bool is_visible(const Medium& medium) {
  return medium.extinction > 0.0 || medium.emission != Rgb(0.0);
}

}  // namespace

LoadedVolumes load_volumes(const Scene& scene) {
  LoadedVolumes loaded;
  for (const Named<Medium>& volume : scene.volumes) {
    const Medium& medium = *volume.object;
    loaded.push_back(is_visible(medium) ? named_errors("volume", volume.name, [&] { return medium.load(); })
                                        : nullptr);
  }
  return loaded;
}

World build_world(const Scene& scene, LoadedVolumes loaded) {
  World world;
  for (size_t i = 0; i < scene.volumes.size(); ++i) {
    const auto& [name, object] = scene.volumes[i];
    const Medium& medium = *object;
    if (!is_visible(medium)) continue;
    const auto density = named_errors("volume", name, [&] {
      return loaded[i] ? std::exchange(loaded[i], nullptr)->build() : medium.build(scene.freeforms);
    });
    world.media.push_back({name, density, medium.extinction, medium.albedo, medium.emission, medium.phase,
                           scatter_terms(medium.multiple_scattering, medium.powder),
                           ambient_light(medium.ambient, *density, name)});
  }
  for (const Named<Light>& light : scene.lights) world.lights.push_back(light.object);
  for (const Named<Shape>& object : scene.objects) {
    const auto* formed = dynamic_cast<const FormedShape*>(object.object.get());
    world.shapes.push_back(
        formed ? named_errors("object", object.name, [&] { return formed->build(scene.freeforms); })
               : object.object);
  }
  world.background = scene.background;
  world.camera = scene.camera;
  return world;
}

std::optional<WorldHit> nearest_surface(const World& world, const Ray& ray, Segment segment) {
  std::optional<WorldHit> nearest;
  for (const auto& shape : world.shapes) {
    if (const auto hit = shape->intersect(ray, segment)) {
      nearest = WorldHit{hit->t, hit->n, hit->error, shape.get(), hit->is_inside};
      segment.t1 = hit->t;
    }
  }
  return nearest;
}

bool is_occluded(const World& world, const Ray& ray, Segment segment) {
  return std::any_of(world.shapes.begin(), world.shapes.end(), [&](const auto& shape) {
    return shape->casts_shadow() && shape->intersect(ray, segment).has_value();
  });
}

}  // namespace pileus
