#include "lib/cloud/cloud_noise.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace pileus {

namespace {

/// The slow noise that warps, against the first octave.
constexpr double kWarpFrequency = 0.5;

/// Where the three components of the warp lie in the noise [lattice units].
const std::array<Vec3d, 3> kWarpShifts{Vec3d{17.31, 5.73, 41.19}, Vec3d{71.87, 29.41, 3.57},
                                       Vec3d{11.03, 83.29, 57.61}};

/// Rounding of pattern points, in units of the coordinates.
constexpr double kPointError = 2e-15;

OctaveSum kind_of(const std::string& type) {
  return type == "fbm" ? OctaveSum::fbm : type == "ridged" ? OctaveSum::ridged : OctaveSum::billow;
}

double shape(OctaveSum kind, double noise) {
  switch (kind) {
    case OctaveSum::fbm:
      return noise;
    case OctaveSum::billow:
      return std::fabs(noise);
    case OctaveSum::ridged:
      return (1 - std::fabs(noise)) * (1 - std::fabs(noise));
  }
  return 0;
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

/// The first octave climbs, the others leave each other in directions spread evenly over the sphere.
Vec3d evolution_direction(int octave) {
  constexpr double kGoldenAngle = 2.39996322972865332;
  const double y = octave == 0 ? -1 : -1 + 2 * std::fmod(0.618033988749895 * octave, 1.0);
  const double across = std::sqrt(std::max(0.0, 1 - y * y));
  return {across * std::cos(kGoldenAngle * octave), y, across * std::sin(kGoldenAngle * octave)};
}

/// Lattice units from one octave to the next, as in Fbm.
const Vec3d kOctaveShift{0.8191725133961645, 0.6710436067037893, 0.5497004779019703};

std::vector<NoiseOctave> octaves_of(const CloudNoiseRecipe& recipe, double frequency) {
  std::vector<NoiseOctave> octaves;
  double sum = 0.0, amplitude = 1.0;
  for (int i = 0; i < recipe.octaves; ++i) {
    octaves.push_back(
        {frequency, kOctaveShift * double(i) + recipe.evolution * evolution_direction(i), amplitude});
    sum += amplitude;
    amplitude *= recipe.gain;
    frequency *= recipe.lacunarity;
  }
  for (NoiseOctave& octave : octaves) octave.amplitude /= sum;
  return octaves;
}

/// What a single octave can be anywhere.
Interval octave_bound(OctaveSum kind) {
  const Interval whole = shape(kind, Interval{-kPerlinBound, kPerlinBound});
  return {std::min(0.0, whole.lo), std::max(0.0, whole.hi)};
}

/// The same in a box, tight where that is small against the octave's cells.
Interval octave_bound(OctaveSum kind, const PerlinNoise& noise, const NoiseOctave& octave, const Box3d& box) {
  constexpr double kManyCells = 4, kFarCells = 0x1p40;
  const Vec3d center = box.center(), size = box.size();
  const double reach = std::max({std::fabs(center.x), std::fabs(center.y), std::fabs(center.z)});
  const double edge =
      std::max({size.x, size.y, size.z}) * (1 + 1e-9) + 1e-12 * reach + 1e-12 / octave.frequency;
  const bool is_small = edge * octave.frequency < kManyCells && reach * octave.frequency < kFarCells;
  if (!is_small) return octave.amplitude * octave_bound(kind);  // also where the box is not finite
  float lo = 0, hi = 0;
  bound_octaves(kind, noise.tables(), {&octave, 1}, {center, edge, Vec3i(1)}, {&lo, 1}, {&hi, 1});
  const double margin = kNoiseMargin * octave.amplitude;
  return {double(lo) - margin, double(hi) + margin};
}

}  // namespace

CloudNoise::CloudNoise(const CloudNoiseRecipe& recipe, double frequency)
    : m_kind(kind_of(recipe.type)),
      m_noise(uint64_t(recipe.seed)),
      m_octaves(octaves_of(recipe, frequency)),
      m_rests(m_octaves.size() + 1),
      m_base(m_kind == OctaveSum::fbm ? 0.5 : 0.0),
      m_offset(recipe.offset),
      m_stretch(recipe.stretch),
      m_warp(recipe.warp / frequency),
      m_warp_frequency(kWarpFrequency * frequency) {
  for (size_t i = m_octaves.size(); i-- > 0;) {
    m_rests[i] = m_rests[i + 1] + m_octaves[i].amplitude * octave_bound(m_kind);
  }
}

Vec3d CloudNoise::warp(const Vec3d& q) const {
  Vec3d moved;
  for (int axis = 0; axis < 3; ++axis) {
    moved[axis] = m_warp * m_noise.value(q * m_warp_frequency + kWarpShifts[size_t(axis)]);
  }
  return moved;
}

Vec3d CloudNoise::pattern_point(const Vec3d& p_world) const {
  const Vec3d q = (p_world - m_offset) / m_stretch;
  return m_warp > 0 ? q + warp(q) : q;
}

Box3d CloudNoise::pattern_box(const Box3d& box_world) const {
  const Box3d still((box_world.min - m_offset) / m_stretch, (box_world.max - m_offset) / m_stretch);
  if (m_warp == 0) return still;  // rounding is monotone
  Box3d box = still;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3d shift = kWarpShifts[size_t(axis)];
    const Interval moved = octave_bound(OctaveSum::fbm, m_noise, {m_warp_frequency, shift, m_warp}, still);
    const double scale = std::fabs(still.min[axis]) + std::fabs(still.max[axis]) + m_warp;
    box.min[axis] += moved.lo - kPointError * scale;
    box.max[axis] += moved.hi + kPointError * scale;
  }
  return box;
}

double CloudNoise::sum(const Vec3d& p_world) const {
  const Vec3d q = pattern_point(p_world);
  double sum = 0.0;
  for (const NoiseOctave& octave : m_octaves) {
    sum += octave.amplitude * shape(m_kind, m_noise.value(q * octave.frequency + octave.shift));
  }
  return sum;
}

Interval CloudNoise::octave_range(size_t i, const Box3d& box_world) const {
  return octave_bound(m_kind, m_noise, m_octaves[i], pattern_box(box_world));
}

Interval CloudNoise::range(const Box3d& box_world) const {
  Interval sum;
  for (size_t i = 0; i < m_octaves.size(); ++i) sum = sum + octave_range(i, box_world);
  return level(sum);
}

void CloudNoise::octave_sums(size_t first, size_t last, const PointLattice& points,
                             std::span<float> sums) const {
  const std::span octaves(m_octaves.data() + first, last - first);
  const PointLattice still{(points.first - m_offset) / m_stretch, points.step / m_stretch, points.count};
  if (m_warp == 0) return lattice_sums(m_kind, octaves, still, sums);
  sum_octaves(m_kind, m_noise.tables(), octaves, warped_points(still), sums, {});
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
    const NoiseOctave slow{m_warp_frequency, kWarpShifts[size_t(axis)], m_warp};
    lattice_sums(OctaveSum::fbm, {&slow, 1}, still, moved);
    for (size_t n = 0; n < points.size(); ++n) points[n][axis] += double(moved[n]);
  }
  return points;
}

void CloudNoise::lattice_sums(OctaveSum kind, std::span<const NoiseOctave> octaves,
                              const PointLattice& points, std::span<float> sums) const {
  const Vec3d &origin = points.first, &step = points.step;
  const Vec3i& count = points.count;
  const auto kernel = [&](const Vec3d& from, double spacing, const Vec3i& block, std::span<float> values) {
    sum_octaves(kind, m_noise.tables(), octaves, {from, spacing, block}, values, {});
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
