#pragma once

#include <algorithm>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "lib/math/lerp.h"
#include "lib/math/transmittance.h"
#include "lib/math/vec.h"

namespace pileus {

class ParamTable;
class DensityField;

/// Multiple scattering by octaves of single scattering: octave i is light that went through more of the
/// medium than a straight path would let it, spread more evenly. Octave 0 is single scattering itself.
///   sum over i < octaves of contribution^i * p_i * exp(-extinction^i * tau)
/// ref: wrenninge2013
struct MultipleScattering {
  int octaves = 1;
  double extinction = 0.5;    ///< of one octave relative to the one before [1]
  double contribution = 0.5;  ///< the same for the brightness
  double phase = 0.5;         ///< the same for how far the phase function is from isotropic

  void describe(ParamTable& params);
};

/// Darkens where little of the medium lies towards the light, by the factor 1 - strength * exp(-extinction *
/// tau): there, light has not been scattered often enough to come back. Gives creases and edges their lines.
struct Powder {
  double strength = 0.0;
  double extinction = 2.0;  ///< [1] per optical depth

  void describe(ParamTable& params);
};

/// Radiance that a volume receives from all around, above and below it [W/(m2 sr)].
struct SkyAround {
  Rgb top{0.0, 0.0, 0.0};
  Rgb bottom{0.0, 0.0, 0.0};

  void describe(ParamTable& params);
};

/// One exponential of the response of a medium to a light behind an optical depth tau:
///   scale * (1/(4 pi) + anisotropy * (p - 1/(4 pi))) * exp(-extinction * tau)
/// with p the phase function. Single scattering is one term {1, 1, 1}.
struct ScatterTerm {
  double scale = 1.0;
  double extinction = 1.0;
  double anisotropy = 1.0;
};

/// The terms of a medium, octave by octave: {b^i, a^i, c^i}, and with powder {-s b^i, a^i + k, c^i} besides.
std::vector<ScatterTerm> scatter_terms(const MultipleScattering& octaves, const Powder& powder);

/// scale * (1/(4 pi) + anisotropy * (p - 1/(4 pi))): what of a term stays the same along the light's path
/// [1/sr]. Gives p itself, to the last bit, for {1, 1, 1}.
inline double phase_weight(const ScatterTerm& term, double p) {
  return term.scale * lerp(0.25 * std::numbers::inv_pi, p, term.anisotropy);
}

/// Radiance that a medium of albedo 1 scatters towards the viewer, per unit extinction and per unit
/// irradiance of a light behind the optical depth tau: the sum of the terms [1/sr].
inline double scatter_response(std::span<const ScatterTerm> terms, double p, double tau) {
  double sum = 0.0;
  for (const ScatterTerm& term : terms) {
    sum += phase_weight(term, p) * transmittance(term.extinction * tau);
  }
  return sum;
}

/// Upper bound of the response at every optical depth >= tau, for the terms of scatter_terms(): those below
/// zero never outweigh their octave.
inline double scatter_response_bound(std::span<const ScatterTerm> terms, double p, double tau = 0.0) {
  double sum = 0.0;
  for (const ScatterTerm& term : terms) {
    sum += std::max(phase_weight(term, p), 0.0) * transmittance(term.extinction * tau);
  }
  return sum;
}

/// The light of the sky around a medium, isotropic at each point: a medium of albedo 1 scatters it as it is.
struct AmbientLight {
  Rgb bottom{0.0, 0.0, 0.0}, top{0.0, 0.0, 0.0};  ///< radiance at y0 and at y1 [W/(m2 sr)]
  double y0 = 0.0, y1 = 1.0;                      ///< [m], finite, y0 < y1

  /// bottom + (top - bottom) * clamp((y - y0) / (y1 - y0), 0, 1)
  Rgb at(double y) const { return bottom + (top - bottom) * std::clamp((y - y0) / (y1 - y0), 0.0, 1.0); }
  bool is_on() const { return bottom != Rgb(0.0) || top != Rgb(0.0); }
};

/// The sky around a volume with the given density. errors: Error(scene), naming the volume, where it has no
/// top or no bottom and the radiances there differ
AmbientLight ambient_light(const SkyAround& sky, const DensityField& density, const std::string& volume);

}  // namespace pileus
