#include "lib/noise/fbm.h"

#include <cmath>

namespace pileus {

namespace {

/// Lattice units from one octave to the next: the generalised golden ratio in three dimensions (powers of
/// the root of x^4 = x + 1), which keeps the lattices of different octaves from meeting.
const Vec3d kOctaveShift{0.8191725133961645, 0.6710436067037893, 0.5497004779019703};

/// sum gain^i * shape(n(p_i))
template <class Shape>
double octave_sum(const FbmParams& params, const PerlinNoise& noise, const Vec3d& p_world, Shape shape) {
  double sum = 0.0, amplitude = 1.0, frequency = params.frequency;
  for (int i = 0; i < params.octaves; ++i) {
    sum += amplitude * shape(noise.value(p_world * frequency + kOctaveShift * double(i)));
    amplitude *= params.gain;
    frequency *= params.lacunarity;
  }
  return sum;
}

}  // namespace

Fbm::Fbm(const FbmParams& params) : m_params(params), m_noise(uint64_t(params.seed)) {
  double sum = 0.0, amplitude = 1.0;
  for (int i = 0; i < params.octaves; ++i, amplitude *= params.gain) sum += amplitude;
  m_normalization = 1.0 / sum;
}

double Fbm::value(const Vec3d& p_world) const {
  return m_normalization * octave_sum(m_params, m_noise, p_world, [](double n) { return n; });
}

double Fbm::billow(const Vec3d& p_world) const {
  return m_normalization * octave_sum(m_params, m_noise, p_world, [](double n) { return std::fabs(n); });
}

}  // namespace pileus
