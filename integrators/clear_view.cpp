#include "integrators/clear_view.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "lib/math/beam.h"

namespace pileus {
namespace {

double width_at(const Beam& beam, double t) {
  const Vec3d size = beam.box(t, t).size();
  return std::max({size.x, size.y, size.z});
}

/// Stretch by stretch, each twice as long behind one in which nothing is met.
bool is_clear(const MarchGrid& grid, const Beam& local) {
  constexpr int kMostLooks = 256, kMostLevel = 8;
  Segment way = local.inside(grid.bounds);
  if (way.empty()) return true;
  const Box3d& d = local.d;
  double fastest2 = 0.0;
  for (int axis = 0; axis < 3; ++axis)
    fastest2 += std::max(d.min[axis] * d.min[axis], d.max[axis] * d.max[axis]);
  const double voxel = 1.0 / std::sqrt(fastest2);
  int least = 0;  // stretches about as long as the beam is wide
  while (least < kMostLevel && double(BrickGrid::kBrickCells << least) < width_at(local, way.t0)) ++least;

  int level = least;
  for (int looks = 0; looks < kMostLooks; ++looks) {
    const double end = std::min(way.t0 + double(BrickGrid::kBrickCells << level) * voxel, way.t1);
    if (!(end > way.t0)) return false;  // so far away that t does not move
    if (grid.pyramid->range(local.box(way.t0, end)).hi == 0.0f) {
      if (end == way.t1) return true;
      way.t0 = end;
      level = std::min(level + 1, kMostLevel);
    } else if (level-- == least) {
      return false;
    }
  }
  return false;
}

Beam beam_of(std::span<const Ray> rays) {
  Beam beam{Box3d(rays[0].o), Box3d(rays[0].d)};
  for (size_t i = 1; i < rays.size(); ++i) {
    if (rays[i].o != rays[i - 1].o) beam.o.extendBy(rays[i].o);
    for (int axis = 0; axis < 3; ++axis) {
      beam.d.min[axis] = std::min(beam.d.min[axis], rays[i].d[axis]);
      beam.d.max[axis] = std::max(beam.d.max[axis], rays[i].d[axis]);
    }
  }
  return beam;
}

Beam beam_of(std::span<const Beam> beams) {
  Beam all = beams[0];
  for (const Beam& beam : beams.subspan(1)) {
    all.o.extendBy(beam.o);
    all.d.extendBy(beam.d);
  }
  return all;
}

}  // namespace

bool is_clear(const MarchScene& scene, std::span<const WorldMedium* const> media, const Beam& beam) {
  const size_t looked_into = scene.places.empty() && scene.is_leaping ? scene.grids.size() : 0;
  for (size_t m = 0; m < looked_into; ++m) {
    const MarchGrid& grid = scene.grids[m];
    if (!is_clear(grid, seen_from(grid.local_from_world, beam))) return false;
  }
  return std::all_of(
      media.begin() + std::ptrdiff_t(looked_into), media.end(),
      [&](const WorldMedium* medium) { return beam.inside(medium->density->bounds()).empty(); });
}

void find_clear(const MarchScene& scene, std::span<const WorldMedium* const> media, std::span<const Ray> rays,
                std::span<char> clear) {
  std::array<Beam, kMostClear> beams;
  for (size_t block = 0; block < clear.size(); ++block) {
    const size_t first = block * kClearRays;
    beams[block] = beam_of(rays.subspan(first, std::min(kClearRays, rays.size() - first)));
  }
  const bool all_clear = is_clear(scene, media, beam_of(std::span(beams).first(clear.size())));
  for (size_t block = 0; block < clear.size(); ++block)
    clear[block] = all_clear || (clear.size() > 1 && is_clear(scene, media, beams[block]));
}

}  // namespace pileus
