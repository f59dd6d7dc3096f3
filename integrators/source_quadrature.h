#pragma once

#include <functional>
#include <queue>

#include "integrators/ray_profile.h"
#include "lib/math/vec.h"

namespace pileus {

/// The light scattered towards the camera along a ray, integral of source * sigma_t * T dt, by adaptive
/// Gauss–Kronrod panels with a global error estimate.
///
/// While a panel spans several cells, or is deeper than an optical depth of 1/2, its variable is the opacity
/// 1 - T: the integrand is then just the source function, which varies slowly where the density does not, and
/// the thin lit skin of a dense medium fills the panel. In thin panels within one span the variable is the
/// distance, in which the integrand is smooth, so that the order of the rule is kept.
class SourceQuadrature {
 public:
  /// In-scattered radiance / sigma_t at t [m], which lies in a span of the profile.
  using Source = std::function<Rgb(size_t span, double t)>;

  struct Result {
    Rgb radiance{0.0, 0.0, 0.0};
    double error = 0.0;  ///< estimated, largest channel
  };

  SourceQuadrature(const RayProfile& profile, Source source)
      : m_profile(profile), m_source(std::move(source)) {}

  /// Refines until the estimate is at most `tolerance`, or 1e-9 of the radiance where that is more.
  ///   source_bound: upper bound of the source in any channel; may be infinite
  Result integrate(double source_bound, double tolerance);

 private:
  /// A stretch of the ray: several whole spans, or [t0, t1) within one.
  struct Panel {
    size_t first, last;  ///< spans [first, last)
    double t0, t1;       ///< [m]
    double tau0, tau1;   ///< optical depth from the start of the ray to t0 and t1
    Rgb value{0.0, 0.0, 0.0};
    double error = 0.0;

    bool in_one_span() const { return last - first == 1; }
    bool operator<(const Panel& other) const { return error < other.error; }
  };

  void add_run(size_t first, size_t last, double source_bound, double tolerance);
  void add_divided(const Panel& panel, int halvings, double short_length);
  void add(Panel panel);
  bool is_divisible(const Panel& panel) const;
  std::pair<Panel, Panel> halves(const Panel& panel) const;

  /// Optical depth, from the start of the ray, at which a share x of the panel's own opacity is reached.
  static double tau_at_opacity(const Panel& panel, double x);
  /// The span of the panel and the t at which an optical depth is reached.
  std::pair<size_t, double> place_of(const Panel& panel, double tau) const;
  static bool is_smooth_in_distance(const Panel& panel);
  Rgb along_distance(const Panel& panel, double x) const;
  Rgb along_opacity(const Panel& panel, double x) const;
  Rgb sum_near_to_far();

  const RayProfile& m_profile;
  Source m_source;
  std::priority_queue<Panel> m_panels;  ///< the worst on top
  Rgb m_total{0.0, 0.0, 0.0};
  double m_error = 0.0;
};

}  // namespace pileus
