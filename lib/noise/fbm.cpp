#include "lib/noise/fbm.h"

#include <cmath>

namespace pileus {

namespace {

/// Lattice units from one octave to the next: the generalised golden ratio in three dimensions (powers of
/// the root of x^4 = x + 1), which keeps the lattices of different octaves from meeting.
const Vec3d kOctaveShift{0.8191725133961645, 0.6710436067037893, 0.5497004779019703};

std::vector<NoiseOctave> normalized_octaves(const FbmParams& params) {
  std::vector<NoiseOctave> octaves;
  double sum = 0.0, amplitude = 1.0, frequency = params.frequency;
  for (int i = 0; i < params.octaves; ++i) {
    octaves.push_back({frequency, kOctaveShift * double(i), amplitude});
    sum += amplitude;
    amplitude *= params.gain;
    frequency *= params.lacunarity;
  }
  for (NoiseOctave& octave : octaves) octave.amplitude /= sum;
  return octaves;
}

Vec3d lattice_point(const NoiseOctave& octave, const Vec3d& p_world) {
  return p_world * octave.frequency + octave.shift;
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

}  // namespace

Fbm::Fbm(const FbmParams& params) : m_noise(uint64_t(params.seed)), m_octaves(normalized_octaves(params)) {}

double Fbm::value(OctaveSum kind, const Vec3d& p_world) const {
  double sum = 0.0;
  for (const NoiseOctave& octave : m_octaves) {
    sum += octave.amplitude * shape(kind, m_noise.value(lattice_point(octave, p_world)));
  }
  return sum;
}

void Fbm::evaluate(OctaveSum kind, const NoiseBlock& block, std::span<float> values) const {
  sum_octaves(kind, m_noise.tables(), m_octaves, block, values);
}

Interval Fbm::bound(OctaveSum kind, const Box3d& box_world) const {
  Interval sum;
  for (const NoiseOctave& octave : m_octaves) {
    const Box3d box(lattice_point(octave, box_world.min), lattice_point(octave, box_world.max));
    sum = sum + octave.amplitude * shape(kind, m_noise.bound(box));
  }
  return sum;
}

}  // namespace pileus
