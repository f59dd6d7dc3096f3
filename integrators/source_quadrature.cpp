#include "integrators/source_quadrature.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "lib/math/gauss_kronrod.h"
#include "lib/math/transmittance.h"

namespace pileus {
namespace {

constexpr double kTightest = 1e-9;    ///< relative error aimed at where the tolerance asks for less
constexpr int kFirstHalvings = 4;     ///< of every run of spans, so that no filament slips between the points
constexpr double kSafety = 2.0;       ///< error reported for each unit of |7-point - 3-point|
constexpr double kNegligible = 1e-3;  ///< share of the tolerance below which a run is not looked at
constexpr size_t kMaxPanels = 4096;   ///< per ray; what is left of the error then is reported
constexpr double kShortestPanel = 1e-12;  ///< relative to t: shorter ones are rounding

double largest(const Rgb& rgb) {
  return std::max({std::abs(rgb.x), std::abs(rgb.y), std::abs(rgb.z)});
}

}  // namespace

SourceQuadrature::Result SourceQuadrature::integrate(double source_bound, double tolerance) {
  const auto& spans = m_profile.spans();
  for (size_t first = 0; first < spans.size();) {
    size_t last = first + 1;
    while (last < spans.size() && !spans[last].starts_run) ++last;
    add_run(first, last, source_bound, tolerance);
    first = last;
  }
  while (!m_panels.empty() && m_panels.size() < kMaxPanels) {
    const Panel worst = m_panels.top();
    const bool is_done = m_error <= std::max(tolerance, kTightest * largest(m_total));
    if (is_done || worst.error == 0.0 || !is_divisible(worst)) break;
    m_panels.pop();
    m_total -= worst.value;
    m_error -= worst.error;
    const auto [near, far] = halves(worst);
    add(near);
    add(far);
  }
  return {sum_near_to_far(), m_error};
}

void SourceQuadrature::add_run(size_t first, size_t last, double source_bound, double tolerance) {
  const auto& spans = m_profile.spans();
  const Panel run{first,
                  last,
                  spans[first].t0,
                  spans[last - 1].t1,
                  spans[first].tau0,
                  spans[last - 1].tau0 + spans[last - 1].tau};
  // What lies behind opaque material cannot matter.
  const double most = source_bound * transmittance(run.tau0) * opacity_from_tau(run.tau1 - run.tau0);
  if (most <= kNegligible * tolerance) {
    m_error += most;
  } else {
    add_divided(run, kFirstHalvings, (run.t1 - run.t0) / (1 << kFirstHalvings));
  }
}

/// Adds a panel in 2^halvings parts; a part within one span that is short already stays whole.
void SourceQuadrature::add_divided(const Panel& panel, int halvings, double short_length) {
  if (halvings == 0 || (panel.in_one_span() && panel.t1 - panel.t0 <= short_length)) return add(panel);
  const auto [near, far] = halves(panel);
  add_divided(near, halvings - 1, short_length);
  add_divided(far, halvings - 1, short_length);
}

void SourceQuadrature::add(Panel panel) {
  Rgb kronrod(0.0), gauss(0.0);
  for (const auto& node : GaussKronrod7::kNodes) {
    const Rgb f = is_smooth_in_distance(panel) ? along_distance(panel, node.x) : along_opacity(panel, node.x);
    kronrod += node.kronrod * f;
    gauss += node.gauss * f;
  }
  panel.value = kronrod;
  panel.error = kSafety * largest(kronrod - gauss);
  m_total += panel.value;
  m_error += panel.error;
  m_panels.push(panel);
}

bool SourceQuadrature::is_divisible(const Panel& panel) const {
  return !panel.in_one_span() || panel.t1 - panel.t0 > kShortestPanel * std::max(1.0, std::abs(panel.t1));
}

std::pair<SourceQuadrature::Panel, SourceQuadrature::Panel> SourceQuadrature::halves(
    const Panel& panel) const {
  const auto& spans = m_profile.spans();
  const double tau = tau_at_opacity(panel, 0.5);
  if (!panel.in_one_span()) {
    // The span boundary that halves the opacity best.
    size_t cut = panel.first + 1;
    while (cut + 1 < panel.last && spans[cut].tau0 < tau) ++cut;
    return {{panel.first, cut, panel.t0, spans[cut].t0, panel.tau0, spans[cut].tau0},
            {cut, panel.last, spans[cut].t0, panel.t1, spans[cut].tau0, panel.tau1}};
  }
  double t = 0.5 * (panel.t0 + panel.t1);
  if (!is_smooth_in_distance(panel)) {
    const double t_half_opacity = m_profile.t_at(panel.first, tau - spans[panel.first].tau0);
    if (t_half_opacity > panel.t0 && t_half_opacity < panel.t1) t = t_half_opacity;
  }
  const double tau_cut =
      std::clamp(spans[panel.first].tau0 + m_profile.tau_to(panel.first, t), panel.tau0, panel.tau1);
  return {{panel.first, panel.last, panel.t0, t, panel.tau0, tau_cut},
          {panel.first, panel.last, t, panel.t1, tau_cut, panel.tau1}};
}

bool SourceQuadrature::is_smooth_in_distance(const Panel& panel) {
  return panel.in_one_span() && panel.tau1 - panel.tau0 <= 0.5;
}

double SourceQuadrature::tau_at_opacity(const Panel& panel, double x) {
  return panel.tau0 - std::log1p(-x * opacity_from_tau(panel.tau1 - panel.tau0));
}

std::pair<size_t, double> SourceQuadrature::place_of(const Panel& panel, double tau) const {
  const auto& spans = m_profile.spans();
  const auto begin = spans.begin() + std::ptrdiff_t(panel.first),
             end = spans.begin() + std::ptrdiff_t(panel.last);
  const auto after =
      std::upper_bound(begin, end, tau, [](double value, const auto& s) { return value < s.tau0; });
  const size_t i = after == begin ? panel.first : size_t(after - spans.begin()) - 1;
  return {i, std::clamp(m_profile.t_at(i, tau - spans[i].tau0), panel.t0, panel.t1)};
}

/// The integrand over x in [0, 1] with the distance as variable: source * sigma_t * T * dt/dx.
Rgb SourceQuadrature::along_distance(const Panel& panel, double x) const {
  const double t = panel.t0 + x * (panel.t1 - panel.t0);
  const double tau = m_profile.spans()[panel.first].tau0 + m_profile.tau_to(panel.first, t);
  const double weight = m_profile.sigma_t(panel.first, t) * transmittance(tau) * (panel.t1 - panel.t0);
  return weight > 0.0 ? weight * m_source(panel.first, t) : Rgb(0.0);
}

/// The integrand over x in [0, 1] with the opacity as variable: source * d(opacity)/dx.
Rgb SourceQuadrature::along_opacity(const Panel& panel, double x) const {
  const double weight = transmittance(panel.tau0) * opacity_from_tau(panel.tau1 - panel.tau0);
  if (!(weight > 0.0)) return Rgb(0.0);
  const auto [span, t] = place_of(panel, tau_at_opacity(panel, x));
  return weight * m_source(span, t);
}

/// The sum does not carry the history of the refinement.
Rgb SourceQuadrature::sum_near_to_far() {
  std::vector<Panel> panels;
  for (; !m_panels.empty(); m_panels.pop()) panels.push_back(m_panels.top());
  std::sort(panels.begin(), panels.end(), [](const Panel& a, const Panel& b) { return a.t0 < b.t0; });
  Rgb sum(0.0);
  for (const Panel& panel : panels) sum += panel.value;
  return sum;
}

}  // namespace pileus
