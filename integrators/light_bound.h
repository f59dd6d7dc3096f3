#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "lib/math/vec.h"
#include "lib/scene/scattering.h"

namespace pileus {

/// Upper bound of the light that media scatter towards the viewer, as a function of the optical depth tau
/// towards the lights: a sum of exponentials, which shadow rays follow only as far as it matters.
class LightBound {
 public:
  /// Forgets everything; `terms` is the largest number of terms of a medium.
  void reset(size_t terms);

  /// Raises the bound to cover a medium whose response to a light is the sum of
  /// weights[i] * exp(-terms[i].extinction * tau).
  void cover(std::span<const ScatterTerm> terms, std::span<const Rgb> weights);

  /// Adds the bound of another light.
  void add(const LightBound& light);

  /// Upper bound at every optical depth >= tau.
  double beyond(double tau) const;

  /// The optical depth beyond which less than a hundredth of the tolerance is left; 0 or more, may be
  /// infinite.
  double enough_tau(double tolerance) const;

  /// Upper bound of the change with tau, at any tau.
  double slope() const { return m_slope; }

 private:
  struct Part {
    double most = 0.0;
    double extinction = std::numeric_limits<double>::infinity();
  };

  std::vector<Part> m_parts;  ///< the i-th terms of all media and lights; only what is positive counts
  double m_slope = 0.0;
};

}  // namespace pileus
