#include "lib/noise/fbm.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace pileus {

namespace {

/// Lattice units from one octave to the next: the generalised golden ratio in three dimensions (powers of the
/// root of x^4 = x + 1), which keeps the lattices of different octaves from meeting.
const Vec3d kOctaveShift{0.8191725133961645, 0.6710436067037893, 0.5497004779019703};

/// Where the three noises that displace points are read: octaves far from those of the sum.
constexpr int kWarpShifts[3] = {37, 53, 71};

/// The most cells a tile can have: lattice coordinates up to here fit well into an int.
constexpr double kMaxTile = 1 << 30;

/// Cells of octave i along an axis after which the noise repeats.
double tile_cells(const FbmParams& params, int octave, int axis) {
  return double(params.tile[axis]) * std::pow(params.lacunarity, octave);
}

NoiseVariant octave_variant(const FbmParams& params, int octave) {
  NoiseVariant variant;
  for (int axis = 0; axis < 3; ++axis)
    variant.period[axis] = int(std::lround(tile_cells(params, octave, axis)));
  const double turns = std::round(std::pow(params.lacunarity, 2.0 / 3.0 * octave));
  variant.turn = noise_turn(params.evolution * turns);
  return variant;
}

/// The first octaves, with amplitudes that sum to `sum`.
std::vector<NoiseOctave> make_octaves(const FbmParams& params, int count, int shifts, double sum) {
  std::vector<NoiseOctave> octaves;
  double total = 0.0, amplitude = 1.0, frequency = params.frequency;
  for (int i = 0; i < count; ++i) {
    octaves.push_back({frequency, kOctaveShift * double(i + shifts), amplitude, octave_variant(params, i)});
    total += amplitude;
    amplitude *= params.gain;
    frequency *= params.lacunarity;
  }
  for (NoiseOctave& octave : octaves) octave.amplitude *= sum / total;
  return octaves;
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

double shape_slope(OctaveSum kind, double noise) {
  const double side = noise < 0 ? -1.0 : 1.0;
  switch (kind) {
    case OctaveSum::fbm:
      return 1;
    case OctaveSum::billow:
      return side;
    case OctaveSum::ridged:
      return -2 * side * (1 - std::fabs(noise));
  }
  return 0;
}

NoiseSample octave_sum(OctaveSum kind, const PerlinNoise& noise, const std::vector<NoiseOctave>& octaves,
                       const Vec3d& p) {
  NoiseSample sum{0, Vec3d(0)};
  for (const NoiseOctave& octave : octaves) {
    const NoiseSample n = noise.sample(p * octave.frequency + octave.shift, octave.variant);
    sum.value += octave.amplitude * shape(kind, n.value);
    sum.gradient += octave.amplitude * octave.frequency * shape_slope(kind, n.value) * n.gradient;
  }
  return sum;
}

/// Cubes that cover a box, as many as `parts` along its longest edge.
NoiseBlock covering_cubes(const Box3d& box, int parts) {
  const Vec3d size = box.max - box.min;
  const double longest = std::max({size.x, size.y, size.z});
  NoiseBlock cubes{box.min, std::max(longest / parts, 1e-300), Vec3i(1)};
  for (int axis = 0; axis < 3; ++axis) {
    cubes.count[axis] = std::clamp(int(std::ceil(size[axis] / cubes.spacing)), 1, parts);
  }
  return cubes;
}

std::vector<Vec3d> points_of(const NoiseBlock& block) {
  std::vector<Vec3d> points;
  points.reserve(block.size());
  for (int i = 0; i < block.count.x; ++i) {
    for (int j = 0; j < block.count.y; ++j) {
      for (int k = 0; k < block.count.z; ++k) points.push_back(block.origin + block.spacing * Vec3d(i, j, k));
    }
  }
  return points;
}

Interval everywhere(OctaveSum kind) {
  switch (kind) {
    case OctaveSum::fbm:
      return {-kPerlinBound, kPerlinBound};
    case OctaveSum::billow:
      return {0, kPerlinBound};
    case OctaveSum::ridged:
      return {0, 1 + kNoiseMargin};
  }
  return {};
}

/// What the bounds of the kernels become: wider by the margin, but no sum of |n| or of squares is negative.
Interval rounded_outward(OctaveSum kind, float lo, float hi) {
  const double least = double(lo) - kNoiseMargin;
  return {kind == OctaveSum::fbm ? least : std::max(least, 0.0), double(hi) + kNoiseMargin};
}

}  // namespace

void FbmParams::check(std::vector<std::string>& problems) const {
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < octaves; ++i) {
      const double cells = tile_cells(*this, i, axis);
      if (cells == std::round(cells) && 0 <= cells && cells <= kMaxTile) continue;
      problems.push_back(
          fmt::format("a tile of {} cells along {} has {} cells in octave {}; "
                      "expected a whole number from 0 to {}: a whole "
                      "lacunarity or fewer octaves",
                      tile[axis], "xyz"[axis], cells, i + 1, int(kMaxTile)));
      break;
    }
  }
}

Fbm::Fbm(const FbmParams& params)
    : m_noise(uint64_t(params.seed)),
      m_octaves(make_octaves(params, params.octaves, 0, 1.0)),
      m_warp(params.warp / params.frequency) {
  if (!is_warped()) return;
  const int count = std::min(kWarpOctaves, params.octaves);
  for (int axis = 0; axis < 3; ++axis) {
    m_warp_octaves[axis] = make_octaves(params, count, kWarpShifts[axis], m_warp);
  }
}

double Fbm::value(OctaveSum kind, const Vec3d& p_world) const {
  return sample(kind, p_world).value;
}

NoiseSample Fbm::sample(OctaveSum kind, const Vec3d& p_world) const {
  if (!is_warped()) return octave_sum(kind, m_noise, m_octaves, p_world);
  Vec3d q = p_world;
  Vec3d way_gradients[3];
  for (int axis = 0; axis < 3; ++axis) {
    const NoiseSample way = octave_sum(OctaveSum::fbm, m_noise, m_warp_octaves[axis], p_world);
    q[axis] += way.value;
    way_gradients[axis] = way.gradient;
  }
  NoiseSample sample = octave_sum(kind, m_noise, m_octaves, q);
  // f(q(p)): gradient = sum over the axes of f's derivative times the gradient of q's coordinate.
  const Vec3d slope = sample.gradient;
  for (int axis = 0; axis < 3; ++axis) sample.gradient += slope[axis] * way_gradients[axis];
  return sample;
}

void Fbm::evaluate(OctaveSum kind, const NoiseBlock& block, std::span<float> values) const {
  evaluate(kind, block, values, {});
}

void Fbm::evaluate(OctaveSum kind, const NoiseBlock& block, std::span<float> values,
                   std::span<Vec3f> gradients) const {
  if (!is_warped()) return sum_octaves(kind, m_noise.tables(), m_octaves, block, values, gradients);
  evaluate_warped(kind, block, points_of(block), values, gradients);
}

void Fbm::evaluate(OctaveSum kind, std::span<const Vec3d> points, std::span<float> values) const {
  evaluate(kind, points, values, {});
}

void Fbm::evaluate(OctaveSum kind, std::span<const Vec3d> points, std::span<float> values,
                   std::span<Vec3f> gradients) const {
  if (!is_warped()) return sum_octaves(kind, m_noise.tables(), m_octaves, points, values, gradients);
  evaluate_warped(kind, points, std::vector<Vec3d>(points.begin(), points.end()), values, gradients);
}

template <class Places>
void Fbm::evaluate_warped(OctaveSum kind, const Places& places, std::vector<Vec3d> points,
                          std::span<float> values, std::span<Vec3f> gradients) const {
  std::vector<float> way(points.size());
  std::vector<Vec3f> way_gradients[3];
  for (int axis = 0; axis < 3; ++axis) {
    way_gradients[axis].resize(gradients.size());
    sum_octaves(OctaveSum::fbm, m_noise.tables(), m_warp_octaves[axis], places, way, way_gradients[axis]);
    for (size_t i = 0; i < points.size(); ++i) points[i][axis] += double(way[i]);
  }
  sum_octaves(kind, m_noise.tables(), m_octaves, points, values, gradients);
  for (size_t i = 0; i < gradients.size(); ++i) {
    const Vec3f slope = gradients[i];
    for (int axis = 0; axis < 3; ++axis) gradients[i] += slope[axis] * way_gradients[axis][i];
  }
}

Interval Fbm::bound(OctaveSum kind, const Box3d& box_world, int parts) const {
  const Vec3d size = box_world.max - box_world.min;
  if (!std::isfinite(size.x + size.y + size.z)) return everywhere(kind);
  const NoiseBlock cubes = covering_cubes(box_world, parts);
  std::vector<Interval> bounds(cubes.size());
  bound(kind, cubes, bounds);
  Interval all = bounds.front();
  for (const Interval& bound : bounds) all = hull(all, bound);
  return all;
}

void Fbm::bound(OctaveSum kind, const NoiseBlock& cubes, std::span<Interval> bounds) const {
  NoiseBlock centres = cubes;
  centres.origin += Vec3d(0.5 * cubes.spacing);
  if (is_warped()) return bound_warped(kind, centres, bounds);
  std::vector<float> lo(cubes.size()), hi(cubes.size());
  bound_octaves(kind, m_noise.tables(), m_octaves, centres, lo, hi);
  for (size_t i = 0; i < cubes.size(); ++i) bounds[i] = rounded_outward(kind, lo[i], hi[i]);
}

void Fbm::bound_warped(OctaveSum kind, const NoiseBlock& centres, std::span<Interval> bounds) const {
  std::vector<Vec3d> points = points_of(centres);
  std::vector<double> edges(points.size(), centres.spacing);  // of a cube that holds the displaced one
  std::vector<float> lo(points.size()), hi(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    bound_octaves(OctaveSum::fbm, m_noise.tables(), m_warp_octaves[axis], centres, lo, hi);
    for (size_t i = 0; i < points.size(); ++i) {
      points[i][axis] += 0.5 * (double(lo[i]) + double(hi[i]));
      const double margin = 2 * kNoiseMargin * m_warp;
      edges[i] = std::max(edges[i], centres.spacing + double(hi[i]) - double(lo[i]) + margin);
    }
  }
  for (size_t i = 0; i < points.size(); ++i) {
    float least, most;
    bound_octaves(kind, m_noise.tables(), m_octaves, {points[i], edges[i], Vec3i(1)}, {&least, 1},
                  {&most, 1});
    bounds[i] = rounded_outward(kind, least, most);
  }
}

}  // namespace pileus
