#pragma once

#include <algorithm>
#include <cmath>

#include "lib/noise/fbm.h"
#include "lib/scene/texture.h"

namespace pileus {

/// Octaves of noise with those left out that are too fine for what a pixel sees.
class FilteredNoise {
 public:
  explicit FilteredNoise(const FbmParams& params = {}, OctaveSum kind = OctaveSum::fbm)
      : m_kind(kind), m_noise(uint64_t(params.seed)), m_fbm(params) {
    // What remains of an octave that is averaged out. Means of so many points, off by about 0.003.
    constexpr int kSide = 24;
    double sum = 0.0;
    for (int i = 0; i < kSide * kSide * kSide; ++i) {
      const Vec3d p(i % kSide, i / kSide % kSide, i / (kSide * kSide));
      sum += shape(m_noise.value(p * 0.7318));
    }
    m_mean = sum / (kSide * kSide * kSide);
  }

  /// The sum at a point, for a footprint as wide as `width` [units of p]: an octave fades from footprints of
  /// a quarter of its cells on, and is its mean from a whole cell on.
  double value(const Vec3d& p, double width) const {
    double sum = 0.0;
    for (const NoiseOctave& octave : m_fbm.octaves()) {
      const double share = std::clamp((1.0 - octave.frequency * width) / 0.75, 0.0, 1.0);
      const double fine = share > 0.0 ? shape(m_noise.value(p * octave.frequency + octave.shift)) : 0.0;
      sum += octave.amplitude * (share * fine + (1.0 - share) * m_mean);
    }
    return sum;
  }

 private:
  double shape(double n) const {
    if (m_kind == OctaveSum::billow) return std::fabs(n);
    return m_kind == OctaveSum::ridged ? (1.0 - std::fabs(n)) * (1.0 - std::fabs(n)) : n;
  }

  OctaveSum m_kind;
  PerlinNoise m_noise;
  Fbm m_fbm;
  double m_mean = 0.0;
};

/// How wide a footprint counts for what is no picture: its longer edge, at most 8 times the shorter, so that
/// what is seen at a slant keeps some of its grain.
inline double footprint_width(const TexturedPoint& point) {
  const double a = length(point.a), b = length(point.b);
  return std::min(std::max(a, b), 8.0 * std::min(a, b));
}

}  // namespace pileus
