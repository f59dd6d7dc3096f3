/// The reference: single scattering with the exact transmittance, in double precision.
///
/// Optical depth is exact up to rounding: cell by cell, by the control values of the cubic that the density
/// is along a ray (METHODS §9.1), towards the camera and towards every light. The in-scattered light is
/// integrated by adaptive Gauss–Kronrod panels until the sum of their error estimates is below `tolerance`;
/// the estimate is reported per pixel. With tolerance 0 the quadrature goes on to a relative error of 1e-9.
///
/// While a panel spans several cells its variable is the opacity 1 - T, in which the integrand is just the
/// source function: few points per ray do, because the source varies slowly where the density does not.
/// Within one cell the variable is the distance, where the integrand is smooth, so that the order of the rule
/// is kept.
///
///   [render]
///   integrator = "exact"
///   tolerance = 0.002
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <queue>
#include <vector>

#include "integrators/gauss_kronrod.h"
#include "integrators/lighting.h"
#include "integrators/ray_profile.h"
#include "lib/core/param_table.h"
#include "lib/math/transmittance.h"
#include "lib/scene/integrator.h"

namespace pileus {
namespace {

constexpr double kTightest = 1e-9;    ///< relative error aimed at where the tolerance asks for less
constexpr int kFirstHalvings = 4;     ///< of every run of cells, so that no filament slips between the points
constexpr double kSafety = 2.0;       ///< error reported for each unit of |7-point - 3-point|
constexpr double kOpaqueTau = 745.0;  ///< exp(-tau) is 0 beyond
constexpr size_t kMaxPanels = 4096;   ///< per ray; what is left of the error then is reported

double largest(const Rgb& rgb) {
  return std::max({std::abs(rgb.x), std::abs(rgb.y), std::abs(rgb.z)});
}

/// A stretch of a ray under quadrature: several whole spans, or [t0, t1) within one.
struct Panel {
  size_t first, last;  ///< spans [first, last)
  double t0, t1;       ///< [m]
  Rgb value{0.0, 0.0, 0.0};
  double error = 0.0;

  bool in_one_span() const { return last - first == 1; }
  bool operator<(const Panel& other) const { return error < other.error; }
};

/// Traces one tile's rays; keeps its memory between them.
class ExactTile {
 public:
  ExactTile(const World& world, const EffectPlan& plan, double tolerance)
      : m_world(world), m_plan(plan), m_tolerance(tolerance) {}

  RayResult trace(const Ray& ray) {
    RayResult result;
    result.error = 0.0;
    const uint64_t samples_before = counters.samples();
    const Segment view{0.0, std::numeric_limits<double>::infinity()};
    const std::optional<WorldHit> hit = m_plan.surfaces ? nearest_surface(m_world, ray, view) : std::nullopt;
    if (hit) result.z_first = hit->t;
    if (m_plan.media) add_media(ray, {view.t0, hit ? hit->t : view.t1}, result);
    if (result.transmittance > 0.0) {
      result.radiance += result.transmittance * radiance_at_end(m_world, m_plan, ray, hit, counters,
                                                                [&](const Ray& shadow, Segment segment) {
                                                                  return media_transmittance(shadow, segment);
                                                                });
    }
    if (hit) {
      if (result.transmittance >= 0.5) result.z_half = hit->t;
      result.transmittance = 0.0;
    }
    result.samples = counters.samples() - samples_before;
    return result;
  }

  TraceCounters counters;

 private:
  void add_media(const Ray& ray, Segment segment, RayResult& result) {
    find_shadow_edges(ray, segment);
    m_profile.build(m_world, ray, segment, m_cuts, counters.camera);
    const auto& spans = m_profile.spans();
    if (spans.empty()) return;
    result.transmittance = transmittance(m_profile.tau());
    result.z_first = spans.front().t0;
    result.z_half = half_depth();
    if (m_plan.emission) result.radiance += emitted();
    if (m_plan.scattering) add_scattered(ray, result);
  }

  /// Where along the ray the edge of a solid's shadow is crossed: the in-scattered light jumps there.
  void find_shadow_edges(const Ray& ray, Segment segment) {
    m_cuts.clear();
    if (!m_plan.surface_shadows || !m_plan.scattering) return;
    for (const auto& light : m_world.lights) {
      for (const auto& shape : m_world.shapes) shape->append_shadow_edges(ray, *light, m_cuts);
    }
    std::erase_if(m_cuts, [&](double t) { return !(t > segment.t0 && t < segment.t1); });
  }

  double half_depth() const {
    const double half = std::log(2.0);
    const auto& spans = m_profile.spans();
    const auto after =
        std::find_if(spans.begin(), spans.end(), [&](const auto& s) { return s.tau0 + s.tau >= half; });
    if (after == spans.end()) return std::numeric_limits<double>::infinity();
    return m_profile.t_at(size_t(after - spans.begin()), half - after->tau0);
  }

  /// Light that the media emit themselves: closed form where a medium is alone, else a fixed rule per unit of
  /// optical depth, whose error is below rounding.
  Rgb emitted() const {
    Rgb sum(0.0);
    for (size_t i = 0; i < m_profile.spans().size(); ++i) {
      const auto& span = m_profile.spans()[i];
      const double before = transmittance(span.tau0);
      size_t alone = 0;
      if (m_profile.is_single(i, alone)) {
        const WorldMedium& medium = m_world.media[alone];
        const double column = m_profile.column(i, alone);
        sum += medium.emission * (before * column * phi1(medium.extinction * column));
      } else {
        sum += before * emitted_where_media_overlap(i);
      }
    }
    return sum;
  }

  Rgb emitted_where_media_overlap(size_t i) const {
    const auto& span = m_profile.spans()[i];
    const int parts = 1 + int(std::min(4.0 * span.tau, 3000.0));
    const double h = (span.t1 - span.t0) / parts;
    Rgb sum(0.0);
    for (int part = 0; part < parts; ++part) {
      for (const auto& node : GaussKronrod7::kNodes) {
        const double t = span.t0 + h * (part + node.x);
        const double weight = h * node.kronrod * transmittance(m_profile.tau_to(i, t));
        for (size_t m = 0; m < m_world.media.size(); ++m) {
          sum += m_world.media[m].emission * (weight * m_profile.density(i, m, t));
        }
      }
    }
    return sum;
  }

  // --- in-scattering
  // -----------------------------------------------------------------------------------------------

  void add_scattered(const Ray& ray, RayResult& result) {
    prepare_source(ray);
    const double bound = m_source_bound;
    const bool may_stop_early = m_tolerance > 0.0 && std::isfinite(bound);
    m_enough_tau =
        may_stop_early ? std::clamp(std::log(100.0 * bound / m_tolerance), 0.0, kOpaqueTau) : kOpaqueTau;

    std::priority_queue<Panel> panels;
    Rgb total(0.0);
    double error = may_stop_early ? bound * transmittance(m_enough_tau) : 0.0;
    const auto add = [&](Panel panel) {
      integrate(ray, panel);
      total += panel.value;
      error += panel.error;
      panels.push(panel);
    };
    for_each_run([&](size_t first, size_t last) {
      const auto& spans = m_profile.spans();
      // What lies behind opaque material cannot matter.
      const double most = bound * transmittance(spans[first].tau0) *
                          opacity_from_tau(spans[last - 1].tau0 + spans[last - 1].tau - spans[first].tau0);
      if (most <= 1e-3 * m_tolerance) {
        error += most;
      } else {
        add_divided({first, last, spans[first].t0, spans[last - 1].t1}, kFirstHalvings, add);
      }
    });
    size_t count = panels.size();
    while (!panels.empty() && error > std::max(m_tolerance, kTightest * largest(total)) &&
           count < kMaxPanels) {
      const Panel widest = panels.top();
      if (widest.error == 0.0 || !is_divisible(widest)) break;
      panels.pop();
      total -= widest.value;
      error -= widest.error;
      const auto [near, far] = halves(widest);
      add(near);
      add(far);
      ++count;
    }
    result.radiance += sum_in_order(panels);
    result.error += error;
  }

  /// Sums the panels near to far, so that the result does not carry the history of the refinement.
  static Rgb sum_in_order(std::priority_queue<Panel>& queue) {
    std::vector<Panel> panels;
    for (; !queue.empty(); queue.pop()) panels.push_back(queue.top());
    std::sort(panels.begin(), panels.end(), [](const Panel& a, const Panel& b) { return a.t0 < b.t0; });
    Rgb sum(0.0);
    for (const Panel& panel : panels) sum += panel.value;
    return sum;
  }

  template <class Visit>
  void for_each_run(Visit&& visit) const {
    const auto& spans = m_profile.spans();
    for (size_t first = 0; first < spans.size();) {
      size_t last = first + 1;
      while (last < spans.size() && !spans[last].starts_run) ++last;
      visit(first, last);
      first = last;
    }
  }

  /// Adds a panel in 2^halvings parts, fewer where it has fewer spans.
  template <class Add>
  void add_divided(const Panel& panel, int halvings, Add&& add) {
    if (halvings == 0 || panel.in_one_span()) return add(panel);
    const auto [near, far] = halves(panel);
    add_divided(near, halvings - 1, add);
    add_divided(far, halvings - 1, add);
  }

  bool is_divisible(const Panel& panel) const {
    return !panel.in_one_span() || panel.t1 - panel.t0 > 1e-12 * std::max(1.0, std::abs(panel.t1));
  }

  std::pair<Panel, Panel> halves(const Panel& panel) const {
    const auto& spans = m_profile.spans();
    if (panel.in_one_span()) {
      const double middle = 0.5 * (panel.t0 + panel.t1);
      return {{panel.first, panel.last, panel.t0, middle}, {panel.first, panel.last, middle, panel.t1}};
    }
    // The span boundary that halves the opacity best.
    const double tau = tau_at_opacity(panel, 0.5);
    size_t cut = panel.first + 1;
    while (cut + 1 < panel.last && spans[cut].tau0 < tau) ++cut;
    return {{panel.first, cut, panel.t0, spans[cut].t0}, {cut, panel.last, spans[cut].t0, panel.t1}};
  }

  /// Optical depth (from the start of the ray) at which a share x of the panel's own opacity is reached.
  double tau_at_opacity(const Panel& panel, double x) const {
    const auto& spans = m_profile.spans();
    const double tau0 = spans[panel.first].tau0,
                 tau1 = spans[panel.last - 1].tau0 + spans[panel.last - 1].tau;
    return tau0 - std::log1p(-x * opacity_from_tau(tau1 - tau0));
  }

  void integrate(const Ray& ray, Panel& panel) {
    Rgb kronrod(0.0), gauss(0.0);
    for (const auto& node : GaussKronrod7::kNodes) {
      const Rgb f =
          panel.in_one_span() ? along_distance(ray, panel, node.x) : along_opacity(ray, panel, node.x);
      kronrod += node.kronrod * f;
      gauss += node.gauss * f;
    }
    panel.value = kronrod;
    panel.error = kSafety * largest(kronrod - gauss);
  }

  /// The integrand over x in [0, 1] with the distance as variable: source * sigma_t * T * dt/dx.
  Rgb along_distance(const Ray& ray, const Panel& panel, double x) {
    const double t = panel.t0 + x * (panel.t1 - panel.t0);
    const double tau = m_profile.spans()[panel.first].tau0 + m_profile.tau_to(panel.first, t);
    const double weight = m_profile.sigma_t(panel.first, t) * transmittance(tau) * (panel.t1 - panel.t0);
    return weight > 0.0 ? weight * source(ray, panel.first, t) : Rgb(0.0);
  }

  /// The integrand over x in [0, 1] with the opacity as variable: source * d(opacity)/dx.
  Rgb along_opacity(const Ray& ray, const Panel& panel, double x) {
    const auto& spans = m_profile.spans();
    const double tau0 = spans[panel.first].tau0,
                 tau1 = spans[panel.last - 1].tau0 + spans[panel.last - 1].tau;
    const double weight = transmittance(tau0) * opacity_from_tau(tau1 - tau0);
    if (!(weight > 0.0)) return Rgb(0.0);
    const double tau = tau_at_opacity(panel, x);
    const auto begin = spans.begin() + std::ptrdiff_t(panel.first),
               end = spans.begin() + std::ptrdiff_t(panel.last);
    const auto after =
        std::upper_bound(begin, end, tau, [](double value, const auto& s) { return value < s.tau0; });
    const size_t i = size_t(after - spans.begin()) - 1;
    return weight * source(ray, i, m_profile.t_at(i, tau - spans[i].tau0));
  }

  /// Light weights that stay the same along the ray: albedo * p * E for every medium and sun.
  void prepare_source(const Ray& ray) {
    const size_t lights = m_world.lights.size();
    m_weights.assign(m_world.media.size() * lights, Rgb(0.0));
    m_source_bound = 0.0;
    for (size_t l = 0; l < lights; ++l) {
      if (!m_world.lights[l]->is_directional()) {
        m_source_bound = std::numeric_limits<double>::infinity();
        continue;
      }
      const Illumination light = m_world.lights[l]->at(ray.o);
      double brightest = 0.0;
      for (size_t m = 0; m < m_world.media.size(); ++m) {
        m_weights[m * lights + l] = weight_of(m_world.media[m], -ray.d, light);
        brightest = std::max(brightest, largest(m_weights[m * lights + l]));
      }
      m_source_bound += brightest;
    }
  }

  static Rgb weight_of(const WorldMedium& medium, const Vec3d& wo, const Illumination& light) {
    return medium.albedo * light.irradiance * medium.phase->p(wo, light.wi);
  }

  /// The source function in-scattered radiance / sigma_t, at t in span i: the mean over the media of what
  /// each scatters towards the camera.
  Rgb source(const Ray& ray, size_t i, double t) {
    ++counters.source_samples;
    const size_t media = m_world.media.size(), lights = m_world.lights.size();
    m_share.resize(media);
    double sigma_t = 0.0;
    for (size_t m = 0; m < media; ++m) {
      m_share[m] = m_world.media[m].extinction * m_profile.density(i, m, t);
      sigma_t += m_share[m];
    }
    if (!(sigma_t > 0.0)) return Rgb(0.0);
    Rgb sum(0.0);
    const Vec3d p = ray.at(t);
    for (size_t l = 0; l < lights; ++l) {
      const Light& light = *m_world.lights[l];
      const Illumination here = light.at(p);
      const double visible = visibility(
          m_world, m_plan, p, here, counters,
          [&](const Ray& shadow, Segment segment) { return media_transmittance(shadow, segment); });
      if (visible <= 0.0) continue;
      for (size_t m = 0; m < media; ++m) {
        const Rgb weight =
            light.is_directional() ? m_weights[m * lights + l] : weight_of(m_world.media[m], -ray.d, here);
        sum += weight * (visible * m_share[m] / sigma_t);
      }
    }
    return sum;
  }

  double media_transmittance(const Ray& ray, Segment segment) {
    double tau = 0.0;
    for (const WorldMedium& medium : m_world.media) {
      if (medium.extinction <= 0.0) continue;
      tau += medium.extinction *
             medium.density->column(ray, segment, (m_enough_tau - tau) / medium.extinction, counters.shadow);
      if (tau >= m_enough_tau) break;
    }
    return transmittance(tau);
  }

  const World& m_world;
  const EffectPlan& m_plan;
  double m_tolerance;
  double m_enough_tau = kOpaqueTau;  ///< optical depth beyond which a shadow ray need not look further
  double m_source_bound = 0.0;       ///< upper bound of source() along the present ray
  RayProfile m_profile;
  std::vector<double> m_cuts;
  std::vector<Rgb> m_weights;   ///< [medium][light]
  std::vector<double> m_share;  ///< sigma_t of each medium at the present point
};

class ExactTracer final : public Tracer {
 public:
  ExactTracer(const World& world, const EffectPlan& plan, double tolerance)
      : m_world(world), m_plan(plan), m_tolerance(tolerance) {}

  void trace(std::span<const Ray> rays, std::span<RayResult> results, Counters& counters) const override {
    ExactTile tile(m_world, m_plan, m_tolerance);
    for (size_t i = 0; i < rays.size(); ++i) results[i] = tile.trace(rays[i]);
    tile.counters.add_to(counters);
  }

 private:
  const World& m_world;
  const EffectPlan& m_plan;
  double m_tolerance;
};

struct Exact final : Integrator {
  void describe(ParamTable&) override {}

  std::unique_ptr<const Tracer> prepare(const World& world, const EffectPlan& plan,
                                        const Accuracy& accuracy) const override {
    return std::make_unique<ExactTracer>(world, plan, accuracy.tolerance * accuracy.coarseness);
  }
};

}  // namespace

PILEUS_PLUGIN(Integrator, exact, Exact,
              "the reference: exact optical depth, adaptive quadrature with a stated error")

}  // namespace pileus
