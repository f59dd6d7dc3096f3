#include "integrators/march_places.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "integrators/lamp_lattice.h"
#include "integrators/sun_lattice.h"
#include "lib/core/parallel.h"
#include "lib/math/box.h"
#include "lib/math/offset_point.h"

namespace pileus {
namespace {

constexpr Segment kAll{0.0, std::numeric_limits<double>::infinity()};

/// The box in the world around a grid's bounds, larger by what rounding may do.
Box3d world_box(const Box3d& bounds, const Affine& world_from_local) {
  const Box3d box = box_around(world_from_local, bounds);
  if (box.isEmpty()) return box;
  const Vec3d margin(surface_error(length(box.min) + length(box.max)));
  return {box.min - margin, box.max + margin};
}

/// Metres per cell, in the mean over the axes.
double cell_size(const Affine& local_from_world) {
  return 1.0 / std::cbrt(std::abs(local_from_world.determinant()));
}

/// How a map turns and stretches, but for its size; maps that are alike but for rounding have the same.
std::array<int64_t, 9> turn_of(const Affine& local_from_world) {
  constexpr double kSteps = 1e9;
  const double scale = kSteps * cell_size(local_from_world);
  std::array<int64_t, 9> turn{};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      turn[size_t(3 * row + column)] = std::llround(scale * local_from_world.matrix()[row][column]);
  }
  return turn;
}

/// Places of a grid that are alike but for their size become a kind. Its own place is the smallest: lattices
/// do not tell apart what is darker than dark, and dark is told there.
void add_kinds(size_t grid, size_t first, size_t end, MarchScene& scene) {
  std::map<std::array<int64_t, 9>, std::vector<size_t>> by_turn;
  for (size_t i = first; i < end; ++i) by_turn[turn_of(scene.places[i].local_from_world)].push_back(i);
  for (const auto& [turn, alike] : by_turn) {
    const size_t smallest = *std::min_element(alike.begin(), alike.end(), [&](size_t a, size_t b) {
      return cell_size(scene.places[a].local_from_world) < cell_size(scene.places[b].local_from_world);
    });
    const Affine& own = scene.places[smallest].local_from_world;
    const Affine own_from_local = own.inverse();
    for (const size_t i : alike) {
      MarchPlace& place = scene.places[i];
      place.kind = scene.kinds.size();
      place.kind_from_world = own_from_local * place.local_from_world;
      place.depth_scale = cell_size(place.local_from_world) / cell_size(own);
    }
    scene.kinds.push_back({grid, own});
  }
}

/// Which boxes stand between a box and a sun: those that its centre meets on the way there when they are
/// larger by its half size.
class ShadingFinder {
 public:
  explicit ShadingFinder(const std::vector<Box3d>& boxes) : m_boxes(boxes) {
    // One index for all sizes: boxes are larger by the half size of most, and larger ones look at every box.
    std::vector<double> sizes;
    for (const Box3d& box : boxes) sizes.push_back(box.isEmpty() ? 0.0 : length(box.size()));
    std::vector<double> sorted = sizes;
    std::sort(sorted.begin(), sorted.end());
    constexpr double kMost = 0.98;
    m_usual = 0.5 * sorted[size_t(kMost * double(sorted.size() - 1))];
    std::vector<Box3d> grown;
    for (const Box3d& box : boxes) {
      const bool is_empty = box.isEmpty();
      grown.push_back(is_empty ? box : Box3d(box.min - Vec3d(m_usual), box.max + Vec3d(m_usual)));
    }
    m_grown = BoxIndex(grown);
  }

  std::vector<uint32_t> between(size_t number, const Vec3d& towards_sun) const {
    std::vector<uint32_t> found;
    const Box3d& box = m_boxes[number];
    if (box.isEmpty()) return found;
    const Vec3d center = 0.5 * (box.min + box.max), half = 0.5 * (box.max - box.min);
    const auto add = [&](size_t other) {
      if (m_boxes[other].isEmpty()) return;
      const Box3d grown(m_boxes[other].min - half, m_boxes[other].max + half);
      if (!clip_to_box({center, towards_sun}, kAll, grown).empty()) found.push_back(uint32_t(other));
    };
    if (std::max({half.x, half.y, half.z}) <= m_usual) {
      m_grown.visit({center, towards_sun}, kAll, [&](size_t other, double&) { return add(other), true; });
      std::sort(found.begin(), found.end());
    } else {
      for (size_t other = 0; other < m_boxes.size(); ++other) add(other);
    }
    return found;
  }

 private:
  const std::vector<Box3d>& m_boxes;
  double m_usual = 0.0;  ///< half size up to which boxes use the index [m]
  BoxIndex m_grown;
};

/// Lists what may shade each place. Where so many shade each other that the lists would not end, all count as
/// if they did.
void find_shading(const std::vector<Box3d>& boxes, MarchScene& scene) {
  constexpr size_t kMost = size_t(1) << 26;  // 256 MB
  const ShadingFinder finder(boxes);
  for (const Vec3d& towards_sun : scene.towards_suns) {
    std::vector<std::vector<uint32_t>> lists(boxes.size());
    std::atomic<size_t> total = 0;
    parallel_for(boxes.size(), [&](size_t i) {
      if (total > kMost) return;
      lists[i] = finder.between(i, towards_sun);
      total += lists[i].size();
    });
    PlaceShading& shading = scene.shading.emplace_back();
    if (total > kMost) {
      shading.places.resize(boxes.size());
      std::iota(shading.places.begin(), shading.places.end(), 0u);
      shading.of_place.assign(boxes.size(), {0, boxes.size()});
      continue;
    }
    for (const std::vector<uint32_t>& list : lists) {
      shading.of_place.push_back({shading.places.size(), list.size()});
      shading.places.insert(shading.places.end(), list.begin(), list.end());
    }
  }
}

}  // namespace

void add_places(const std::vector<std::vector<Affine>>& places, MarchScene& scene) {
  const bool has_several =
      std::any_of(places.begin(), places.end(), [](const auto& of_grid) { return of_grid.size() > 1; });
  if (!has_several) {
    for (size_t g = 0; g < scene.grids.size(); ++g)
      scene.kinds.push_back({g, scene.grids[g].local_from_world});
    return;
  }
  std::vector<Box3d> boxes;
  for (size_t g = 0; g < places.size(); ++g) {
    const size_t first = scene.places.size();
    for (const Affine& local_from_world : places[g]) {
      scene.places.push_back({g, local_from_world, 0, Affine(), 1.0});
      boxes.push_back(world_box(scene.grids[g].bounds, local_from_world.inverse()));
    }
    add_kinds(g, first, scene.places.size(), scene);
  }
  scene.place_index = BoxIndex(boxes);
  find_shading(boxes, scene);
}

std::vector<GridOnRay> grids_on_ray(const MarchScene& scene, const Ray& ray) {
  std::vector<GridOnRay> found;
  const auto add = [&](const MarchGrid& grid, const Affine& local_from_world) {
    const Ray local{local_from_world.point(ray.o), local_from_world.direction(ray.d)};
    const Segment inside = clip_to_box(local, kAll, grid.bounds);
    if (!inside.empty()) found.push_back({grid, local, inside});
  };
  if (scene.places.empty()) {
    for (const MarchGrid& grid : scene.grids) add(grid, grid.local_from_world);
    return found;
  }
  std::vector<size_t> places;
  scene.place_index.visit(ray, kAll, [&](size_t place, double&) { return places.push_back(place), true; });
  std::sort(places.begin(), places.end());
  for (const size_t number : places) {
    const MarchPlace& place = scene.places[number];
    add(scene.grids[place.grid], place.local_from_world);
  }
  return found;
}

double lattice_depth(const MarchScene& scene, size_t light, const Vec3d& p) {
  if (const MarchLamp* lamp = scene.lamp(light)) {
    double depth = 0.0;
    for (const std::vector<LampFace>& faces : lamp->faces) depth += lamp_depth(faces, p);
    return depth;
  }
  const SunLattice* const lattices = scene.lattices.data() + light * scene.kinds.size();
  double depth = 0.0;
  if (scene.places.empty()) {
    for (size_t kind = 0; kind < scene.kinds.size(); ++kind) depth += sun_depth(lattices[kind], p);
    return depth;
  }
  std::vector<size_t> places;
  scene.place_index.visit({p, scene.towards_suns[light]}, kAll,
                          [&](size_t place, double&) { return places.push_back(place), true; });
  std::sort(places.begin(), places.end());
  for (const size_t number : places) {
    const MarchPlace& place = scene.places[number];
    if (scene.grids[place.grid].extinction > 0.0)
      depth += place.depth_scale * sun_depth(lattices[place.kind], place.kind_from_world.point(p));
  }
  return depth;
}

}  // namespace pileus
