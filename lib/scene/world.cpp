#include "lib/scene/world.h"

#include <algorithm>
#include <map>
#include <utility>

#include <fmt/ranges.h>

#include "lib/core/error.h"
#include "lib/core/named_errors.h"
#include "lib/scene/formed_shape.h"
#include "lib/scene/instanced_medium.h"

namespace pileus {
namespace {

/// Makes objects of what they are made of, each once.
class ShapeBuilder {
 public:
  explicit ShapeBuilder(const Scene& scene)
      : m_sources{scene.freeforms, [this](const std::string& name) { return build(name); }} {
    for (const Named<Shape>& object : scene.objects) m_objects[object.name] = object.object;
  }
  ShapeBuilder(const ShapeBuilder&) = delete;  // the sources lead back here
  ShapeBuilder& operator=(const ShapeBuilder&) = delete;

  std::shared_ptr<const Shape> build(const std::string& name) {
    const std::shared_ptr<const Shape>& object = m_objects.at(name);  // the reader has checked names
    const auto* formed = dynamic_cast<const FormedShape*>(object.get());
    if (!formed) return object;
    std::shared_ptr<const Shape>& built = m_built[name];
    if (built) return built;
    check_path(name);
    m_path.push_back(name);
    built = formed->build(m_sources);
    m_path.pop_back();
    return built;
  }

 private:
  void check_path(const std::string& name) const {
    constexpr size_t kDeepest = 32;
    if (std::find(m_path.begin(), m_path.end(), name) != m_path.end()) {
      throw Error(ErrorKind::scene, SourceLoc{},
                  fmt::format("is made of itself: {} -> {}; expected objects that do not lead back",
                              fmt::join(m_path, " -> "), name));
    }
    if (m_path.size() >= kDeepest) {
      throw Error(
          ErrorKind::scene, SourceLoc{},
          fmt::format("is made of objects that are made of objects, more than {} times; expected fewer",
                      kDeepest));
    }
  }

  std::map<std::string, std::shared_ptr<const Shape>> m_objects, m_built;
  std::vector<std::string> m_path;  ///< objects that are being made, each of the next
  ShapeSources m_sources;
};

/// Neither loaded nor built otherwise, unless instances are: the effect plan says so.
bool is_visible(const Medium& medium) {
  return !medium.hidden && (medium.extinction > 0.0 || medium.emission != Rgb(0.0));
}

/// The number of a volume; that of none where there is none of this name.
size_t number_of(const std::string& name, const Scene& scene) {
  const auto named = std::find_if(scene.volumes.begin(), scene.volumes.end(),
                                  [&](const Named<Medium>& volume) { return volume.name == name; });
  return size_t(named - scene.volumes.begin());
}

/// The volumes that are seen, and those that these are instances of.
std::vector<bool> needed_volumes(const Scene& scene) {
  std::vector<bool> needed(scene.volumes.size());
  for (size_t i = 0; i < needed.size(); ++i) {
    if (!is_visible(*scene.volumes[i].object)) continue;
    for (size_t next = i; next < needed.size() && !needed[next];) {
      needed[next] = true;
      const auto* instance = dynamic_cast<const InstancedMedium*>(scene.volumes[next].object.get());
      if (!instance) break;
      next = number_of(instance->original(), scene);
    }
  }
  return needed;
}

/// Makes densities of what has been loaded for volumes, each once.
class DensityBuilder {
 public:
  DensityBuilder(const Scene& scene, LoadedVolumes loaded)
      : m_scene(scene), m_loaded(std::move(loaded)), m_built(m_loaded.size()) {}

  std::shared_ptr<const DensityField> build(size_t number) {
    std::shared_ptr<const DensityField>& built = m_built[number];
    if (!built) {
      const Named<Medium>& volume = m_scene.volumes[number];
      built = named_errors("volume", volume.name, [&] { return make(number, *volume.object); });
    }
    return built;
  }

 private:
  std::shared_ptr<const DensityField> make(size_t number, const Medium& medium) {
    if (m_loaded[number]) return std::exchange(m_loaded[number], nullptr)->build();
    if (const auto* instance = dynamic_cast<const InstancedMedium*>(&medium))
      return instance->place(build(number_of(instance->original(), m_scene)));
    return medium.build(m_scene.freeforms);
  }

  const Scene& m_scene;
  LoadedVolumes m_loaded;
  std::vector<std::shared_ptr<const DensityField>> m_built;
};

/// The light that a fog names, as it shines everywhere.
Illumination sun_of(const FogModel& fog, const Scene& scene) {
  const std::string name = fog.sun_name();
  if (name.empty()) return FogView().sun;
  const auto named = std::find_if(scene.lights.begin(), scene.lights.end(),
                                  [&](const Named<Light>& light) { return light.name == name; });
  PILEUS_CHECK(named != scene.lights.end());
  if (!named->object->is_directional()) {
    throw Error(ErrorKind::scene, SourceLoc{},
                fmt::format("sun = \"{}\" is a light at a finite distance; expected a sun", name));
  }
  return named->object->at(Vec3d(0.0));
}

/// Where the camera looks, in world space.
Vec3d view_axis(const Camera& camera) {
  const Imath::M44d camera_from_world = camera.camera_from_world();
  return -normalize(Vec3d(camera_from_world[0][2], camera_from_world[1][2], camera_from_world[2][2]));
}

}  // namespace

LoadedVolumes load_volumes(const Scene& scene) {
  const std::vector<bool> needed = needed_volumes(scene);
  LoadedVolumes loaded;
  for (size_t i = 0; i < scene.volumes.size(); ++i) {
    const Medium& volume = *scene.volumes[i].object;
    loaded.push_back(needed[i] ? named_errors("volume", scene.volumes[i].name, [&] { return volume.load(); })
                               : nullptr);
  }
  return loaded;
}

World build_world(const Scene& scene, LoadedVolumes loaded) {
  World world;
  DensityBuilder densities(scene, std::move(loaded));
  for (size_t i = 0; i < scene.volumes.size(); ++i) {
    const auto& [name, object] = scene.volumes[i];
    const Medium& medium = *object;
    if (!is_visible(medium)) continue;
    const auto density = densities.build(i);
    world.media.push_back({name, density, medium.extinction, medium.albedo, medium.emission, medium.phase,
                           scatter_terms(medium.multiple_scattering, medium.powder),
                           ambient_light(medium.ambient, *density, name)});
  }
  for (const Named<Light>& light : scene.lights) world.lights.push_back(light.object);
  ShapeBuilder shape_builder(scene);
  for (const Named<Shape>& object : scene.objects) {
    if (object.object->hidden) continue;
    world.shapes.push_back(
        named_errors("object", object.name, [&] { return shape_builder.build(object.name); }));
  }
  std::vector<const Shape*> shapes;
  for (const auto& shape : world.shapes) shapes.push_back(shape.get());
  world.index = std::make_shared<const ShapeIndex>(std::move(shapes));
  for (const Named<FogModel>& fog : scene.fogs) {
    if (!fog.object->is_visible()) continue;
    const Illumination sun = named_errors("fog", fog.name, [&] { return sun_of(*fog.object, scene); });
    world.fogs.push_back({fog.name, fog.object, {view_axis(*scene.camera), sun}});
  }
  world.background = scene.background;
  world.camera = scene.camera;
  return world;
}

std::optional<WorldHit> nearest_surface(const World& world, const Ray& ray, Segment segment,
                                        const RaySight& seen, std::span<const double> clear) {
  if (world.index) return world.index->nearest(ray, segment, seen, clear);
  std::optional<WorldHit> nearest;
  for (const auto& shape : world.shapes) {
    if (const auto hit = shape->intersect_seen(ray, segment, seen)) {
      nearest = WorldHit{hit->t, hit->n, hit->error, shape.get(), hit->is_inside};
      segment.t1 = hit->t;
    }
  }
  return nearest;
}

void nearest_surfaces(const World& world, std::span<const Ray> rays, std::span<const RaySight> seen,
                      std::span<const double> clear, std::span<std::optional<WorldHit>> hits) {
  if (world.index) return world.index->nearest(rays, seen, clear, hits);
  for (size_t i = 0; i < rays.size(); ++i) {
    hits[i] = nearest_surface(world, rays[i], {0.0, std::numeric_limits<double>::infinity()},
                              seen.empty() ? RaySight{} : seen[i], clear);
  }
}

void clear_distances(const World& world, std::span<const Ray> rays, const RaySight& seen,
                     std::vector<double>& clear) {
  clear.clear();
  if (world.index) world.index->clear_distances(rays, seen, clear);
}

bool is_occluded(const World& world, const Ray& ray, Segment segment, const RaySight& seen) {
  if (world.index) return world.index->is_occluded(ray, segment, seen);
  return std::any_of(world.shapes.begin(), world.shapes.end(), [&](const auto& shape) {
    return shape->casts_shadow() && !shape->has_holes() &&
           shape->intersect_seen(ray, segment, seen).has_value();
  });
}

void find_occluded(const World& world, std::span<const Ray> rays, std::span<const Segment> segments,
                   std::span<const RaySight> seen, std::span<char> occluded) {
  if (world.index) return world.index->find_occluded(rays, segments, seen, occluded);
  for (size_t i = 0; i < rays.size(); ++i) occluded[i] = is_occluded(world, rays[i], segments[i], seen[i]);
}

double light_through_holes(const World& world, const Ray& ray, Segment segment, const RaySight& seen,
                           uint64_t& crossings) {
  if (world.index) return world.index->light_through_holes(ray, segment, seen, crossings);
  double passed = 1.0;
  for (const auto& shape : world.shapes) {
    if (shape->has_holes()) passed *= shape->light_through(ray, segment, seen, crossings);
  }
  return passed;
}

}  // namespace pileus
