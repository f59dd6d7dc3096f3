#include "lib/cloud/cloud_noise.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace pileus {

namespace {

/// Rounding of pattern points, in units of the coordinates.
constexpr double kPointError = 2e-15;

OctaveSum kind_of(const std::string& type) {
  return type == "fbm" ? OctaveSum::fbm : type == "ridged" ? OctaveSum::ridged : OctaveSum::billow;
}

Interval shape(OctaveSum kind, const Interval& noise) {
  switch (kind) {
    case OctaveSum::fbm:
      return noise;
    case OctaveSum::billow:
      return abs(noise);
    case OctaveSum::ridged:
      return square(Interval{1, 1} + -1.0 * abs(noise));
  }
  return {};
}

FbmParams fbm_params(const CloudNoiseRecipe& recipe, double frequency) {
  FbmParams params;
  params.octaves = recipe.octaves;
  params.frequency = frequency;
  params.lacunarity = recipe.lacunarity;
  params.gain = recipe.gain;
  params.seed = recipe.seed;
  params.evolution = recipe.evolution;
  params.warp = recipe.warp;
  return params;
}

/// What a single octave can be anywhere.
Interval octave_bound(OctaveSum kind) {
  const Interval whole = shape(kind, Interval{-kPerlinBound, kPerlinBound});
  return {std::min(0.0, whole.lo), std::max(0.0, whole.hi)};
}

/// Cubes that cover a box, wider by a margin: one, or several in a row where it is longer than wide.
NoiseBlock covering_cubes(const Box3d& box, double margin) {
  constexpr double kMostInARow = 4;
  const Vec3d size = box.size() + Vec3d(2 * margin);
  const double longest = std::max({size.x, size.y, size.z});
  NoiseBlock cubes{Vec3d(), std::max(std::min({size.x, size.y, size.z}), longest / kMostInARow), Vec3i(1)};
  cubes.spacing *= 1 + 1e-9;
  for (int axis = 0; axis < 3; ++axis) {
    cubes.count[axis] = std::max(1, int(std::ceil(size[axis] / cubes.spacing)));
    cubes.origin[axis] = box.center()[axis] - 0.5 * cubes.spacing * (cubes.count[axis] - 1);
  }
  return cubes;
}

/// The same in a box, tight where that is small against the octave's cells.
Interval octave_bound(OctaveSum kind, const NoiseTables& tables, const NoiseOctave& octave,
                      const Box3d& box) {
  constexpr double kManyCells = 4, kFarCells = 0x1p40;
  const Vec3d center = box.center(), size = box.size();
  const double reach = std::max({std::fabs(center.x), std::fabs(center.y), std::fabs(center.z)});
  const double edge = std::max({size.x, size.y, size.z});
  const bool is_small = edge * octave.frequency < kManyCells && reach * octave.frequency < kFarCells;
  if (!is_small) return octave.amplitude * octave_bound(kind);  // also where the box is not finite
  const NoiseBlock cubes = covering_cubes(box, 1e-12 * (reach + edge) + 1e-12 / octave.frequency);
  constexpr size_t kMostCubes = 5 * 5 * 5;
  std::array<float, kMostCubes> lo, hi;
  const size_t count = cubes.size();
  bound_octaves(kind, tables, {&octave, 1}, cubes, {lo.data(), count}, {hi.data(), count});
  const double margin = kNoiseMargin * octave.amplitude;
  return {double(*std::min_element(lo.data(), lo.data() + count)) - margin,
          double(*std::max_element(hi.data(), hi.data() + count)) + margin};
}

}  // namespace

CloudNoise::CloudNoise(const CloudNoiseRecipe& recipe, double frequency)
    : m_kind(kind_of(recipe.type)),
      m_fbm(fbm_params(recipe, frequency)),
      m_rests(octaves() + 1),
      m_base(m_kind == OctaveSum::fbm ? 0.5 : 0.0),
      m_offset(recipe.offset),
      m_stretch(recipe.stretch) {
  for (size_t i = octaves(); i-- > 0;) {
    m_rests[i] = m_rests[i + 1] + m_fbm.octaves()[i].amplitude * octave_bound(m_kind);
  }
}

Box3d CloudNoise::pattern_box(const Box3d& box_world) const {
  const Box3d still(pattern_point(box_world.min), pattern_point(box_world.max));
  if (!m_fbm.is_warped()) return still;  // rounding is monotone
  Box3d box = still;
  for (int axis = 0; axis < 3; ++axis) {
    Interval moved;
    for (const NoiseOctave& octave : m_fbm.warp_octaves(axis))
      moved = moved + octave_bound(OctaveSum::fbm, m_fbm.tables(), octave, still);
    const double scale = std::fabs(still.min[axis]) + std::fabs(still.max[axis]) + moved.magnitude();
    box.min[axis] += moved.lo - kPointError * scale;
    box.max[axis] += moved.hi + kPointError * scale;
  }
  return box;
}

Interval CloudNoise::octave_range(size_t i, const Box3d& pattern_box) const {
  return octave_bound(m_kind, m_fbm.tables(), m_fbm.octaves()[i], pattern_box);
}

Interval CloudNoise::range(const Box3d& box_world) const {
  const Box3d pattern = pattern_box(box_world);
  Interval sum;
  for (size_t i = 0; i < octaves(); ++i) sum = sum + octave_range(i, pattern);
  return level(sum);
}

void CloudNoise::octave_sums(size_t first, size_t last, const PointLattice& points,
                             std::span<float> sums) const {
  const std::span octaves = m_fbm.octaves().subspan(first, last - first);
  const PointLattice still{pattern_point(points.first), points.step / m_stretch, points.count};
  if (!m_fbm.is_warped()) return lattice_sums(m_kind, octaves, still, sums);
  sum_octaves(m_kind, m_fbm.tables(), octaves, warped_points(still), sums, {});
}

std::vector<Vec3d> CloudNoise::warped_points(const PointLattice& still) const {
  std::vector<Vec3d> points;
  points.reserve(still.size());
  for (int i = 0; i < still.count.x; ++i) {
    for (int j = 0; j < still.count.y; ++j) {
      for (int k = 0; k < still.count.z; ++k) points.push_back(still.first + still.step * Vec3d(i, j, k));
    }
  }
  std::vector<float> moved(still.size());
  for (int axis = 0; axis < 3; ++axis) {
    lattice_sums(OctaveSum::fbm, m_fbm.warp_octaves(axis), still, moved);
    for (size_t n = 0; n < points.size(); ++n) points[n][axis] += double(moved[n]);
  }
  return points;
}

void CloudNoise::lattice_sums(OctaveSum kind, std::span<const NoiseOctave> octaves,
                              const PointLattice& points, std::span<float> sums) const {
  const Vec3d &origin = points.first, &step = points.step;
  const Vec3i& count = points.count;
  const auto kernel = [&](const Vec3d& from, double spacing, const Vec3i& block, std::span<float> values) {
    sum_octaves(kind, m_fbm.tables(), octaves, {from, spacing, block}, values, {});
  };
  const auto at = [&](int i, int j) { return (size_t(i) * size_t(count.y) + size_t(j)) * size_t(count.z); };

  // The kernel's points are equally far apart along all axes of a block: where they are not, planes or rows.
  if (step.x == step.y && step.y == step.z) return kernel(origin, step.x, count, sums);
  for (int i = 0; i < count.x; ++i) {
    if (step.y == step.z) {
      kernel(origin + Vec3d(i * step.x, 0, 0), step.y, {1, count.y, count.z},
             sums.subspan(at(i, 0), size_t(count.y) * size_t(count.z)));
      continue;
    }
    for (int j = 0; j < count.y; ++j) {
      kernel(origin + Vec3d(i * step.x, j * step.y, 0), step.z, {1, 1, count.z},
             sums.subspan(at(i, j), size_t(count.z)));
    }
  }
}

}  // namespace pileus
