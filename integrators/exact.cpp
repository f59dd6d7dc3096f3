/// The reference: scattering with the exact optical depth towards each light, in double precision.
///
/// Optical depth is exact up to rounding: cell by cell, by the control values of the cubic that the density
/// is along a ray (METHODS §9.1), towards the camera and towards every light. The in-scattered light is
/// integrated by adaptive Gauss–Kronrod panels until the sum of their error estimates is below `tolerance`;
/// the estimate is reported per pixel. With tolerance 0 the quadrature goes on to a relative error of 1e-9.
/// Fog dims and covers what every point of the ray sends, in closed form (docs/fog.md).
///
///   [render]
///   integrator = "exact"
///   tolerance = 0.002
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "integrators/hole_edges.h"
#include "integrators/light_bound.h"
#include "integrators/lighting.h"
#include "integrators/ray_ends.h"
#include "integrators/ray_fog.h"
#include "integrators/ray_profile.h"
#include "integrators/source_quadrature.h"
#include "lib/core/param_table.h"
#include "lib/math/box_shadow.h"
#include "lib/math/gauss_kronrod.h"
#include "lib/math/transmittance.h"
#include "lib/scene/integrator.h"
#include "lib/scene/point_source.h"

namespace pileus {
namespace {

constexpr double kOpaqueTau = 745.0;  ///< exp(-tau) is 0 beyond

double largest(const Rgb& rgb) {
  return std::max({std::abs(rgb.x), std::abs(rgb.y), std::abs(rgb.z)});
}

/// Traces one tile's rays; keeps its memory between them.
class ExactTile {
 public:
  ExactTile(const World& world, const EffectPlan& plan, const RayEnds& ends, const FogSetup& fog,
            double tolerance)
      : m_world(world),
        m_plan(plan),
        m_ends(ends),
        m_whole_tolerance(tolerance),
        m_ambient(media_with_ambient(world)),
        m_fog(fog),
        m_dark_tau(kOpaqueTau / slowest_extinction(world)) {
    m_shades_hazes = plan.scattering && world.media.size() > 1 &&
                     std::any_of(world.media.begin(), world.media.end(),
                                 [](const WorldMedium& medium) { return !medium.density->has_bricks(); });
    for (const WorldMedium& medium : world.media) {
      m_terms = std::max(m_terms, medium.scattering.size());
      m_densest += medium.extinction * medium.density->max_density();
    }
    for (const size_t m : m_ambient) {
      const WorldMedium& medium = world.media[m];
      for (const Rgb& sky : {medium.ambient.bottom, medium.ambient.top}) {
        m_ambient_bound = std::max(m_ambient_bound, largest(medium.albedo * sky));
      }
    }
  }

  /// Traces neighbouring rays from the camera: what they meet, and without media the shadows there, is asked
  /// of them together.
  void trace(std::span<const Ray> rays, std::span<RayResult> results) {
    m_hits.assign(rays.size(), std::nullopt);
    if (m_plan.surfaces) {
      constexpr size_t kFewest = 16;  // rays for which one look pays
      std::vector<double> clear;
      const std::vector<RaySight> seen(rays.size(), m_ends.sight({}));
      if (rays.size() >= kFewest) clear_distances(m_world, rays, seen.front(), clear);
      nearest_surfaces(m_world, rays, seen, clear, m_hits);
      if (!m_plan.media) m_ends.light_points(rays, m_hits, m_lit, counters);
    }
    for (size_t i = 0; i < rays.size(); ++i) results[i] = trace(rays[i], {}, m_hits[i], i);
  }

  TraceCounters counters;

 private:
  RayResult trace(const Ray& ray, const RayPath& path) {
    const Segment view{0.0, std::numeric_limits<double>::infinity()};
    return trace(ray, path, nearest_surface(m_world, ray, view, m_ends.sight(path)), 0);
  }

  ///   number: of a ray from the camera
  RayResult trace(const Ray& ray, const RayPath& path, const std::optional<WorldHit>& hit, size_t number) {
    RayResult result;
    result.error = 0.0;
    m_tolerance = share_of_tolerance(path);
    const uint64_t samples_before = counters.samples();
    if (hit) result.z_first = hit->t;
    const double t_end = hit ? hit->t : std::numeric_limits<double>::infinity();
    if (m_plan.fog) m_fog.build(ray, t_end, path.bounces == 0);
    if (m_plan.media) add_media(ray, {0.0, t_end}, result);
    if (m_plan.fog) put_fog_before_end(result);
    if (result.transmittance > 0.0) add_end(ray, hit, path, number, result);
    if (hit) {
      if (!std::isfinite(result.z_half)) result.z_half = hit->t;
      result.transmittance = 0.0;
    }
    result.samples = counters.samples() - samples_before;
    return result;
  }

  /// Halved from surface to surface where rays go on, so that the errors of all add up to the tolerance.
  double share_of_tolerance(const RayPath& path) const {
    return m_plan.secondary_rays() ? std::ldexp(m_whole_tolerance, -1 - path.bounces) : m_whole_tolerance;
  }

  /// What is seen at the end of the ray; the last thing that is asked of it, as rays that go on from there
  /// take the place of this one.
  void add_end(const Ray& ray, const std::optional<WorldHit>& hit, const RayPath& path, size_t number,
               RayResult& result) {
    const double passed = result.transmittance;
    const auto depth = [&](const Ray& shadow, Segment segment) {
      return media_depth(shadow, segment, kOpaqueTau);
    };
    const auto go_on = [&](const SecondaryRay& next) {
      const RayResult seen = trace(next.ray, next.path);
      result.error += passed * largest(next.weight) * seen.error;
      return seen.radiance;
    };
    const bool is_lit_ahead = hit && path.bounces == 0 && !m_plan.media;
    result.radiance +=
        passed * (is_lit_ahead ? m_ends.radiance(ray, *hit, path, passed, m_lit.points[number],
                                                 m_lit.lights_at(number), counters, go_on)
                               : m_ends.radiance(ray, hit, path, passed, counters, depth, go_on));
  }

  void add_media(const Ray& ray, Segment segment, RayResult& result) {
    find_shadow_edges(ray, segment);
    if (m_shades_hazes) cut_at_shadows_of_media(ray, segment);
    if (m_plan.fog) cut_at_fog(segment);
    if (m_plan.scattering && m_plan.local_lights) cut_at_lamps(ray, segment);
    m_profile.build(m_world, ray, segment, m_cuts, counters.camera);
    const auto& spans = m_profile.spans();
    if (spans.empty()) return;
    result.transmittance = transmittance(m_profile.tau());
    result.z_first = spans.front().t0;
    result.z_half = half_depth();
    if (m_plan.emission) result.radiance += emitted();
    if (m_plan.scattering || m_plan.ambient || m_plan.fog) add_scattered(ray, result);
  }

  /// Where along the ray the edge of a solid's shadow is crossed: the in-scattered light jumps there.
  void find_shadow_edges(const Ray& ray, Segment segment) {
    m_cuts.clear();
    m_hole_edges = 0;
    if (!m_plan.surface_shadows || !m_plan.scattering) return;
    for (const auto& light : m_world.lights) {
      for (const auto& shape : m_world.shapes)
        if (shape->casts_shadow()) add_edges(ray, segment, *shape, *light);
    }
    std::erase_if(m_cuts, [&](double t) { return !(t > segment.t0 && t < segment.t1); });
  }

  /// On a long way through a haze, the shadow that another medium throws there would slip between the points.
  void cut_at_shadows_of_media(const Ray& ray, Segment segment) {
    constexpr int kParts = 8;
    const Segment in_media = media_range(m_world, ray, segment);
    if (in_media.empty() || !std::isfinite(in_media.length())) return;
    for (const auto& light : m_world.lights) {
      if (!light->is_directional()) continue;
      for (const WorldMedium& medium : m_world.media) {
        const Segment shadow = shadow_of_box(ray, in_media, light->at(ray.o).wi, medium.density->bounds());
        const bool has_edge = shadow.t0 > in_media.t0 || shadow.t1 < in_media.t1;
        if (shadow.empty() || !has_edge) continue;
        for (int n = 0; n <= kParts; ++n) {
          const double t = shadow.t0 + double(n) / kParts * shadow.length();
          if (t > segment.t0 && t < segment.t1) m_cuts.push_back(t);
        }
      }
    }
  }

  /// Where holes throw their light is looked for.
  void add_edges(const Ray& ray, Segment segment, const Shape& shape, const Light& light) {
    if (!shape.has_holes() || shape.knows_shadow_edges()) shape.append_shadow_edges(ray, light, m_cuts);
    if (!shape.has_holes()) return;
    m_hole_edges += append_hole_edges(shape, ray, media_range(m_world, ray, segment), light,
                                      edge_depth() / m_densest, m_cuts, counters.texture_lookups);
  }

  /// Optical depth to which edges of light from holes are found.
  double edge_depth() const {
    constexpr double kShare = 1e-3, kLeast = 1e-14;
    return std::max(kShare * m_tolerance, kLeast);
  }

  /// What shows of the end of the ray is dimmed, and the fog in front of it is added.
  void put_fog_before_end(RayResult& result) {
    ++counters.fog_veils;
    const Veil veil = m_fog.end();
    result.radiance += result.transmittance * veil.light;
    result.transmittance *= veil.transmittance;
  }

  Veil veil_at(double t) {
    ++counters.fog_veils;
    return m_fog.to(t);
  }

  /// Of fog that may be opaque: behind that nothing counts.
  double fog_depth_between(double t0, double t1) const {
    constexpr double kOpaqueFog = 45.0;
    return std::min(m_fog.tau_to(t1), kOpaqueFog) - std::min(m_fog.tau_to(t0), kOpaqueFog);
  }

  /// Where fog begins or ends, what shows through it has a kink.
  void cut_at_fog(Segment segment) {
    for (const double t : m_fog.edges()) {
      if (t > segment.t0 && t < segment.t1) m_cuts.push_back(t);
    }
  }

  /// Beside a lamp the light has a peak, which a rule with far nodes may miss: cut where the ray comes
  /// closest, and at distances that grow.
  void cut_at_lamps(const Ray& ray, Segment segment) {
    constexpr double kGrowth = 8.0;
    const Segment media = media_range(m_world, ray, segment);
    for (const auto& light : m_world.lights) {
      const auto* lamp = dynamic_cast<const PointSource*>(light.get());
      if (!lamp) continue;
      const double closest = dot(lamp->position - ray.o, ray.d),
                   r = std::max(length(lamp->position - ray.at(closest)), lamp->radius);
      const auto cut = [&](double t) {
        if (t > media.t0 && t < media.t1) m_cuts.push_back(t);
      };
      cut(closest);
      const double furthest = std::max(media.t1 - closest, closest - media.t0);
      for (double away = kGrowth * r; away < furthest; away *= kGrowth) {
        cut(closest - away);
        cut(closest + away);
      }
    }
  }

  double half_depth() const {
    const double half = std::log(2.0);
    const auto& spans = m_profile.spans();
    const auto after =
        std::find_if(spans.begin(), spans.end(), [&](const auto& s) { return s.tau0 + s.tau >= half; });
    if (after == spans.end()) return std::numeric_limits<double>::infinity();
    return m_profile.t_at(size_t(after - spans.begin()), half - after->tau0);
  }

  /// Light that the media emit themselves: closed form where a medium is alone without fog, else a fixed rule
  /// per unit of optical depth, whose error is below rounding.
  Rgb emitted() {
    Rgb sum(0.0);
    for (size_t i = 0; i < m_profile.spans().size(); ++i) {
      const auto& span = m_profile.spans()[i];
      const double before = transmittance(span.tau0);
      size_t alone = 0;
      if (!m_plan.fog && m_profile.is_single(i, alone)) {
        const WorldMedium& medium = m_world.media[alone];
        const double column = m_profile.column(i, alone);
        sum += medium.emission * (before * column * phi1(medium.extinction * column));
      } else {
        sum += before * emitted_by_rule(i);
      }
    }
    return sum;
  }

  Rgb emitted_by_rule(size_t i) {
    const auto& span = m_profile.spans()[i];
    const double t_end = m_profile.t_at(i, kOpaqueTau);  // nothing shows from behind
    const double tau = std::min(span.tau, kOpaqueTau);
    const double fog = m_plan.fog ? fog_depth_between(span.t0, t_end) : 0.0;
    const int parts = 1 + int(std::min(4.0 * (tau + fog) + m_profile.exponential_rise(i), 1e5));
    const double h = (t_end - span.t0) / parts;
    Rgb sum(0.0);
    for (int part = 0; part < parts; ++part) {
      for (const auto& node : GaussKronrod7::kNodes) {
        const double t = span.t0 + h * (part + node.x);
        double weight = h * node.kronrod * transmittance(m_profile.tau_to(i, t));
        if (m_plan.fog) weight *= veil_at(t).transmittance;
        for (size_t m = 0; m < m_world.media.size(); ++m) {
          sum += m_world.media[m].emission * (weight * m_profile.density(i, m, t));
        }
      }
    }
    return sum;
  }

  void add_scattered(const Ray& ray, RayResult& result) {
    const double light_bound = prepare_source(ray);
    // A shadow ray may stop where the light that is left cannot reach a hundredth of the tolerance.
    const bool may_stop_early = m_tolerance > 0.0 && std::isfinite(light_bound);
    const double enough_tau =
        may_stop_early ? std::min(m_light_bound.enough_tau(m_tolerance), m_dark_tau) : m_dark_tau;
    const double stop_error = may_stop_early ? m_light_bound.beyond(enough_tau) : 0.0;
    const auto in_clear = [&](size_t span, double t) { return source(ray, span, t, enough_tau); };
    const bool is_lit = m_plan.scattering || m_plan.ambient;
    const auto through_fog = [&](size_t span, double t) {
      return veil_at(t).over(is_lit ? in_clear(span, t) : Rgb(0.0));
    };
    SourceQuadrature quadrature(m_profile, m_plan.fog ? SourceQuadrature::Source(through_fog) : in_clear);
    const double fog_bound = m_plan.fog ? largest(m_fog.to(m_profile.spans().back().t1).light) : 0.0;
    const SourceQuadrature::Result scattered =
        quadrature.integrate(light_bound + m_ambient_bound + fog_bound, m_tolerance - stop_error);
    result.error += rounding_error(ray, light_bound);
    if (m_hole_edges > 0 && std::isfinite(light_bound))
      result.error += 0.5 * double(m_hole_edges) * edge_depth() * light_bound;
    result.radiance += scattered.radiance;
    result.error += scattered.error + stop_error;
  }

  /// What the rounding of positions can do to the light that reaches them: a point may lie deeper in the
  /// media than it should by a few ulp of its coordinates. Negligible until the mean free path is that short,
  /// all there is beyond.
  double rounding_error(const Ray& ray, double light_bound) const {
    if (!std::isfinite(light_bound)) return 0.0;
    const double distance = length(ray.o) + m_profile.spans().front().t0;
    double tau = 0.0;
    for (const WorldMedium& medium : m_world.media) {
      tau += medium.extinction * medium.density->max_density() * 8.0 *
             std::numeric_limits<double>::epsilon() * distance;
    }
    return std::min(light_bound, m_light_bound.slope() * tau);
  }

  /// Sets the weights that stay the same along the ray, those of suns, for every medium and term.
  /// Returns an upper bound of the light of all lights in source().
  double prepare_source(const Ray& ray) {
    m_weights.resize(m_world.media.size() * m_world.lights.size() * m_terms);
    m_here.resize(m_terms);
    m_light_bound.reset(m_terms);
    bool all_bounded = true;
    for (size_t l = 0; l < m_world.lights.size(); ++l) {
      if (!m_world.lights[l]->is_directional()) {
        all_bounded = false;
        continue;
      }
      const Illumination light = m_world.lights[l]->at(ray.o);
      m_one_light.reset(m_terms);
      for (size_t m = 0; m < m_world.media.size(); ++m) {
        set_weights(m_world.media[m], -ray.d, light, weights(m, l));
        m_one_light.cover(m_world.media[m].scattering, weights(m, l));
      }
      m_light_bound.add(m_one_light);
    }
    return all_bounded ? m_light_bound.beyond(0.0) : std::numeric_limits<double>::infinity();
  }

  /// albedo * E * phase for every term of the medium's response.
  static void set_weights(const WorldMedium& medium, const Vec3d& wo, const Illumination& light,
                          std::span<Rgb> weights) {
    const double p = medium.phase->p(wo, light.wi);
    for (size_t i = 0; i < medium.scattering.size(); ++i) {
      weights[i] = medium.albedo * light.irradiance * phase_weight(medium.scattering[i], p);
    }
  }

  std::span<Rgb> weights(size_t medium, size_t light) {
    return std::span(m_weights).subspan((medium * m_world.lights.size() + light) * m_terms, m_terms);
  }

  /// The source function in-scattered radiance / sigma_t, at t in span i: the mean over the media of what
  /// each scatters towards the camera.
  Rgb source(const Ray& ray, size_t i, double t, double enough_tau) {
    ++counters.source_samples;
    const size_t media = m_world.media.size();
    m_share.resize(media);
    double sigma_t = 0.0;
    for (size_t m = 0; m < media; ++m) {
      m_share[m] = m_world.media[m].extinction * m_profile.density(i, m, t);
      sigma_t += m_share[m];
    }
    if (!(sigma_t > 0.0)) return Rgb(0.0);
    Rgb sum(0.0);
    const Vec3d p = ray.at(t);
    for (size_t l = 0; l < m_world.lights.size(); ++l) add_light(l, p, -ray.d, sigma_t, enough_tau, sum);
    for (const size_t m : m_ambient) {
      ++counters.ambient_samples;
      sum += m_world.media[m].albedo * m_world.media[m].ambient.at(p.y) * (m_share[m] / sigma_t);
    }
    return sum;
  }

  /// The part of source() that one light brings about.
  void add_light(size_t l, const Vec3d& p, const Vec3d& wo, double sigma_t, double enough_tau, Rgb& sum) {
    const Light& light = *m_world.lights[l];
    const Illumination here = light.at(p);
    const LightWay way = way_to_light(
        m_world, m_plan, p, here, counters,
        [&](const Ray& shadow, Segment segment) { return media_depth(shadow, segment, enough_tau); });
    if (!(way.passed > 0.0)) return;
    for (size_t m = 0; m < m_world.media.size(); ++m) {
      const WorldMedium& medium = m_world.media[m];
      if (!light.is_directional()) set_weights(medium, wo, here, m_here);
      const std::span<const Rgb> weight = light.is_directional() ? weights(m, l) : std::span(m_here);
      for (size_t i = 0; i < medium.scattering.size(); ++i) {
        sum += weight[i] * (way.passed * transmittance(medium.scattering[i].extinction * way.depth) *
                            m_share[m] / sigma_t);
      }
    }
  }

  /// Optical depth of all media in the segment; may stop early once it is at least `enough_tau`.
  double media_depth(const Ray& ray, Segment segment, double enough_tau) {
    double tau = 0.0;
    for (const WorldMedium& medium : m_world.media) {
      if (medium.extinction <= 0.0) continue;
      tau += medium.extinction *
             medium.density->column(ray, segment, (enough_tau - tau) / medium.extinction, counters.shadow);
      if (tau >= enough_tau) break;
    }
    return tau;
  }

  const World& m_world;
  const EffectPlan& m_plan;
  const RayEnds& m_ends;
  double m_whole_tolerance;
  double m_tolerance = 0.0;  ///< of the present ray
  RayProfile m_profile;
  std::vector<std::optional<WorldHit>> m_hits;  ///< of the rays from the camera
  RayEnds::LitPoints m_lit;                     ///< theirs; without media only
  std::vector<double> m_cuts;
  bool m_shades_hazes = false;    ///< some medium may
  size_t m_hole_edges = 0;        ///< of them, those that were found to edge_depth()
  double m_densest = 0.0;         ///< extinction of all media, at most [1/m]
  std::vector<size_t> m_ambient;  ///< media in the light of a sky
  RayFog m_fog;
  double m_ambient_bound = 0.0;  ///< upper bound of its part of source()
  double m_dark_tau;             ///< towards a light: no medium responds beyond
  size_t m_terms = 0;            ///< largest number of terms of a medium's response
  LightBound m_light_bound, m_one_light;
  std::vector<Rgb> m_weights;   ///< [medium][light][term]
  std::vector<Rgb> m_here;      ///< [term]: those of a light at a finite distance, at the present point
  std::vector<double> m_share;  ///< sigma_t of each medium at the present point
};

class ExactTracer final : public Tracer {
 public:
  ExactTracer(const World& world, const EffectPlan& plan, const Accuracy& accuracy, double tolerance)
      : m_world(world),
        m_plan(plan),
        m_ends(world, plan, accuracy),
        m_fog(world, tolerance, accuracy.picture),
        m_tolerance(tolerance) {}

  /// A surface takes less time than an interruption can wait for many times over.
  size_t rays_per_call() const override { return m_plan.media ? 4 : 64; }

  std::vector<std::string> choices() const override {
    return m_fog.choice().empty() ? std::vector<std::string>{} : std::vector<std::string>{m_fog.choice()};
  }

  std::optional<RayResult> seen_alike(const Beam& beam) const override {
    const auto is_aside = [&](const WorldMedium& medium) {
      return beam.inside(medium.density->bounds()).empty();
    };
    if (m_plan.surfaces || m_plan.fog || !std::all_of(m_world.media.begin(), m_world.media.end(), is_aside))
      return {};
    return m_ends.uniform_background();
  }

  void trace(std::span<const Ray> rays, std::span<RayResult> results, Counters& counters) const override {
    ExactTile tile(m_world, m_plan, m_ends, m_fog, m_tolerance);
    tile.trace(rays, results);
    tile.counters.add_to(counters);
  }

 private:
  const World& m_world;
  const EffectPlan& m_plan;
  RayEnds m_ends;
  FogSetup m_fog;
  double m_tolerance;
};

struct Exact final : Integrator {
  void describe(ParamTable&) override {}

  std::unique_ptr<const Tracer> prepare(const World& world, const EffectPlan& plan,
                                        const Accuracy& accuracy) const override {
    // A tolerance of 0 cannot be multiplied: where a coarser picture is wanted, it counts as a very small
    // one.
    const double finest = accuracy.coarseness > 1.0 ? std::max(accuracy.tolerance, 1e-5) : accuracy.tolerance;
    return std::make_unique<ExactTracer>(world, plan, accuracy, finest * accuracy.coarseness);
  }
};

}  // namespace

PILEUS_PLUGIN(Integrator, exact, Exact,
              "the reference: exact optical depth, adaptive quadrature with a stated error")

}  // namespace pileus
