#pragma once

#include <concepts>

#include <ImathVec.h>

#include "lib/math/neumaier_sum.h"
#include "lib/math/transmittance.h"

namespace pileus {

/// Composites what a ray meets, near to far: sum_n L_n T_n, with T_n the transmittance before n.
///
/// The state is the optical depth passed so far, not the transmittance: a running product of n factors drifts
/// by n roundings, a compensated sum does not (METHODS 1.4). What remains behind an early stop still counts:
/// over() adds the background through it, so that a stop at the transmittance zeta costs at most zeta times
/// the spread of the sources left out, background included.
///
/// ref:     METHODS 1.3, 1.4; porter1984 (over)
/// units:   radiance [W/(m2 sr)], finite; optical depth [1], >= 0, +inf for an opaque surface
template <std::floating_point T>
class Compositor {
 public:
  using Colour = Imath::Vec3<T>;

  /// done() once the transmittance has fallen to `stop_transmittance`.
  explicit Compositor(T stop_transmittance = 0) : m_stop_transmittance(stop_transmittance) {}

  /// A segment whose own radiance, as seen from its near end, is known.
  void add_radiance(T tau, const Colour& radiance) {
    m_radiance += radiance * m_transmittance;  // with the transmittance before the segment
    m_tau.add(tau);
    m_transmittance = pileus::transmittance(m_tau.value());
  }

  /// A segment with a constant source.
  void add_segment(T tau, const Colour& source) { add_radiance(tau, source * opacity_from_tau(tau)); }

  /// A segment with a source linear in optical depth between its ends.
  void add_gradient(T tau, const Colour& front, const Colour& back) {
    const SourceWeights<T> weights = source_weights(tau);
    add_radiance(tau, front * weights.front + back * weights.back);
  }

  bool done() const { return m_transmittance <= m_stop_transmittance; }

  T tau() const { return m_tau.value(); }
  T transmittance() const { return m_transmittance; }

  /// Radiance gathered so far, premultiplied by opacity.
  const Colour& radiance() const { return m_radiance; }

  /// The finished picture: what was gathered over a background.
  Colour over(const Colour& background) const { return m_radiance + background * m_transmittance; }

 private:
  NeumaierSum<T> m_tau;
  T m_transmittance = 1;
  T m_stop_transmittance;
  Colour m_radiance{T(0), T(0), T(0)};
};

}  // namespace pileus
