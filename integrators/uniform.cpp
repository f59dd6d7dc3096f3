/// The documents' equidistant marcher: the baseline that every faster method must beat.
///
/// Steps of one length dz; each composites the opacity P = 1 - (1 - Omega)^dz, with Omega the opacity of one
/// metre, in its stable form -expm1(-sigma_t dz) (METHODS §1.2). Shadow rays march with the same step.
/// `sample` says where in its step a sample lies: "left" as the documents have it (order 1) or "middle"
/// (order 2).
///
///   [render]
///   integrator = { type = "uniform", step = 0.05 }
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "integrators/default_step.h"
#include "integrators/lighting.h"
#include "integrators/ray_ends.h"
#include "integrators/ray_fog.h"
#include "lib/core/error.h"
#include "lib/core/param_table.h"
#include "lib/math/compositor.h"
#include "lib/scene/integrator.h"

namespace pileus {
namespace {

struct MarchSettings {
  double step;                ///< [m]
  double offset;              ///< position of a sample in its step, 0 .. 1
  double stop;                ///< transmittance at which a ray ends
  double slowest_extinction;  ///< of the responses to light: shadow rays end where `stop` of it is left
  RayEnds ends;               ///< what is seen behind the media
};

/// The densities of all media at a batch of steps: one virtual call per medium and batch.
class DensityBatch {
 public:
  static constexpr size_t kSteps = 64;

  DensityBatch(const World& world, const MarchSettings& settings)
      : m_world(world), m_settings(settings), m_rho(world.media.size()) {}

  /// Reads the steps from t on, up to t_end; returns their number. The last step may be shorter, its sample
  /// is not.
  size_t read(const Ray& ray, double t, double t_end, FieldCounters& counters) {
    const size_t steps = size_t(std::min(double(kSteps), std::ceil((t_end - t) / m_settings.step)));
    for (size_t m = 0; m < m_rho.size(); ++m) {
      m_world.media[m].density->sample(ray, t + m_settings.offset * m_settings.step, m_settings.step,
                                       std::span(m_rho[m]).first(steps), counters);
    }
    return steps;
  }

  double rho(size_t medium, size_t i) const { return m_rho[medium][i]; }

  double sigma_t(size_t i) const {
    double sum = 0.0;
    for (size_t m = 0; m < m_rho.size(); ++m) sum += m_world.media[m].extinction * m_rho[m][i];
    return sum;
  }

  bool is_empty(size_t i) const {
    return std::all_of(m_rho.begin(), m_rho.end(), [&](const auto& rho) { return rho[i] == 0.0; });
  }

 private:
  const World& m_world;
  const MarchSettings& m_settings;
  std::vector<std::array<double, kSteps>> m_rho;  ///< [medium][step]
};

/// Traces one tile's rays; keeps its memory between them. What the plan leaves out is compiled out of the
/// loop.
template <bool kScatters, bool kEmits, bool kFog>
class UniformTile {
 public:
  UniformTile(const World& world, const EffectPlan& plan, const MarchSettings& settings, const FogSetup& fog)
      : m_world(world),
        m_plan(plan),
        m_settings(settings),
        m_view(world, settings),
        m_shadow(world, settings),
        m_fog(fog),
        m_ambient(media_with_ambient(world)) {}

  RayResult trace(const Ray& ray, const RayPath& path = {}) {
    RayResult result;
    const uint64_t samples_before = counters.samples();
    const Segment view{0.0, std::numeric_limits<double>::infinity()};
    const std::optional<WorldHit> hit = m_plan.surfaces ? nearest_surface(m_world, ray, view) : std::nullopt;
    Compositor<double> compositor(m_settings.stop);
    const double t_end = hit ? hit->t : view.t1;
    if constexpr (kFog) m_fog.build(ray, t_end, path.bounces == 0);
    if (m_plan.media) march(ray, {view.t0, t_end}, compositor, result);
    if constexpr (kFog) ++counters.fog_veils;
    const Veil veil = kFog ? m_fog.end() : Veil{};
    const double passed = compositor.transmittance() * veil.transmittance;
    result.radiance = compositor.over(veil.over(m_settings.ends.radiance(
        ray, hit, path, passed, counters,
        [&](const Ray& shadow, Segment segment) { return media_depth(shadow, segment); },
        // The rays that go on take the place of this one, of which nothing more is asked.
        [&](const SecondaryRay& next) { return trace(next.ray, next.path).radiance; })));
    result.transmittance = hit ? 0.0 : passed;
    if (hit) {
      result.z_first = std::min(result.z_first, hit->t);
      result.z_half = std::min(result.z_half, hit->t);
    }
    result.samples = counters.samples() - samples_before;
    return result;
  }

  TraceCounters counters;

 private:
  void march(const Ray& ray, Segment segment, Compositor<double>& compositor, RayResult& result) {
    const Segment range = media_range(m_world, ray, segment);
    for (size_t batch = 0; !compositor.done(); ++batch) {
      const double t = range.t0 + double(batch * DensityBatch::kSteps) * m_settings.step;
      if (!(t < range.t1)) return;
      const size_t steps = m_view.read(ray, t, range.t1, counters.camera);
      for (size_t i = 0; i < steps && !compositor.done(); ++i) {
        if (m_view.is_empty(i)) continue;
        const double near = t + double(i) * m_settings.step;
        add_step(ray, i, {near, std::min(near + m_settings.step, range.t1)}, compositor, result);
      }
    }
  }

  void add_step(const Ray& ray, size_t i, Segment step, Compositor<double>& compositor, RayResult& result) {
    const double tau = m_view.sigma_t(i) * step.length();
    const double mean_transmittance = step.length() * phi1(tau);  // integral of exp(-sigma_t s) over the step
    Rgb radiance(0.0);
    if constexpr (kScatters) {
      const Vec3d p = ray.at(step.t0 + m_settings.offset * m_settings.step);
      if (tau > 0.0) radiance += scattered(p, -ray.d, i) * mean_transmittance;
    }
    if constexpr (kEmits) {
      for (size_t m = 0; m < m_world.media.size(); ++m) {
        radiance += m_world.media[m].emission * (m_view.rho(m, i) * mean_transmittance);
      }
    }
    result.z_first = std::min(result.z_first, step.t0);
    if constexpr (kFog) {
      const Veil veil = veil_at(0.5 * (step.t0 + step.t1));
      radiance = veil.transmittance * radiance + opacity_from_tau(tau) * veil.light;
    }
    compositor.add_radiance(tau, radiance);
    if (compositor.transmittance() < 0.5) result.z_half = std::min(result.z_half, step.t1);
  }

  Veil veil_at(double t) {
    ++counters.fog_veils;
    return m_fog.to(t);
  }

  /// In-scattered radiance per metre at p, which is step i of the view batch.
  Rgb scattered(const Vec3d& p, const Vec3d& wo, size_t i) {
    ++counters.source_samples;
    Rgb sum(0.0);
    for (const auto& light : m_world.lights) {
      const Illumination here = light->at(p);
      const LightWay way =
          way_to_light(m_world, m_plan, p, here, counters,
                       [&](const Ray& shadow, Segment segment) { return media_depth(shadow, segment); });
      if (!(way.passed > 0.0)) continue;
      for (size_t m = 0; m < m_world.media.size(); ++m) {
        const WorldMedium& medium = m_world.media[m];
        const double sigma_t = medium.extinction * m_view.rho(m, i), phase = medium.phase->p(wo, here.wi);
        for (const ScatterTerm& term : medium.scattering) {
          sum +=
              medium.albedo * here.irradiance *
              (way.passed * sigma_t * transmittance(term.extinction * way.depth) * phase_weight(term, phase));
        }
      }
    }
    for (const size_t m : m_ambient) {
      ++counters.ambient_samples;
      const WorldMedium& medium = m_world.media[m];
      sum += medium.albedo * medium.ambient.at(p.y) * (medium.extinction * m_view.rho(m, i));
    }
    return sum;
  }

  /// Optical depth of all media in the segment, marched until no more of the light behind it matters.
  double media_depth(const Ray& ray, Segment segment) {
    const Segment range = media_range(m_world, ray, segment);
    NeumaierSum<double> tau;
    for (size_t batch = 0;; ++batch) {
      const double t = range.t0 + double(batch * DensityBatch::kSteps) * m_settings.step;
      if (!(t < range.t1)) break;
      const size_t steps = m_shadow.read(ray, t, range.t1, counters.shadow);
      for (size_t i = 0; i < steps; ++i) {
        const double near = t + double(i) * m_settings.step;
        tau.add(m_shadow.sigma_t(i) * (std::min(near + m_settings.step, range.t1) - near));
      }
      if (transmittance(m_settings.slowest_extinction * tau.value()) <= m_settings.stop) break;
    }
    return tau.value();
  }

  const World& m_world;
  const EffectPlan& m_plan;
  const MarchSettings& m_settings;
  DensityBatch m_view, m_shadow;
  RayFog m_fog;
  std::vector<size_t> m_ambient;  ///< media in the light of a sky
};

template <bool kScatters, bool kEmits, bool kFog>
class UniformTracer final : public Tracer {
 public:
  UniformTracer(const World& world, const EffectPlan& plan, const MarchSettings& settings,
                const Accuracy& accuracy)
      : m_world(world),
        m_plan(plan),
        m_settings(settings),
        m_fog(world, accuracy.tolerance, accuracy.picture) {}

  void trace(std::span<const Ray> rays, std::span<RayResult> results, Counters& counters) const override {
    UniformTile<kScatters, kEmits, kFog> tile(m_world, m_plan, m_settings, m_fog);
    for (size_t i = 0; i < rays.size(); ++i) results[i] = tile.trace(rays[i]);
    tile.counters.add_to(counters);
  }

 private:
  const World& m_world;
  const EffectPlan& m_plan;
  MarchSettings m_settings;
  FogSetup m_fog;
};

/// A step so short that a ray would never end is a slip of the pen, not a wish for accuracy.
void check_step(const World& world, double step) {
  constexpr double kMostSteps = 1e7;  // per ray
  Box3d all;
  for (const WorldMedium& medium : world.media) all.extendBy(medium.density->bounds());
  const double longest = all.isEmpty() ? 0.0 : length(all.size());
  if (longest <= kMostSteps * step) return;
  throw Error(ErrorKind::usage, SourceLoc{},
              fmt::format("integrator \"uniform\": step = {:.3g} m makes up to {:.3g} steps per ray through "
                          "{:.3g} m of media; "
                          "expected at most {:.3g}: a step of {} m or more",
                          step, longest / step, longest, kMostSteps, longest / kMostSteps));
}

struct Uniform final : Integrator {
  double step = 0.0;
  std::string sample = "middle";

  void describe(ParamTable& params) override {
    params
        .number("step", step, "m",
                "length of a step; 0: half the smallest voxel, or 1/256 of the smallest medium")
        .at_least(0);
    params.text("sample", sample, "where in its step a sample lies").one_of({"middle", "left"});
  }

  std::unique_ptr<const Tracer> prepare(const World& world, const EffectPlan& plan,
                                        const Accuracy& accuracy) const override {
    const double finest = step > 0.0 ? step : default_step(world);
    check_step(world, finest);
    const MarchSettings settings{finest * accuracy.coarseness, sample == "middle" ? 0.5 : 0.0,
                                 accuracy.tolerance / 8.0, slowest_extinction(world),
                                 RayEnds(world, plan, accuracy)};
    return plan.fog ? prepare_for<true>(world, plan, settings, accuracy)
                    : prepare_for<false>(world, plan, settings, accuracy);
  }

 private:
  template <bool kFog>
  static std::unique_ptr<const Tracer> prepare_for(const World& world, const EffectPlan& plan,
                                                   const MarchSettings& settings, const Accuracy& accuracy) {
    const bool scatters = plan.scattering || plan.ambient;
    if (scatters && plan.emission)
      return std::make_unique<UniformTracer<true, true, kFog>>(world, plan, settings, accuracy);
    if (scatters) return std::make_unique<UniformTracer<true, false, kFog>>(world, plan, settings, accuracy);
    if (plan.emission)
      return std::make_unique<UniformTracer<false, true, kFog>>(world, plan, settings, accuracy);
    return std::make_unique<UniformTracer<false, false, kFog>>(world, plan, settings, accuracy);
  }
};

}  // namespace

PILEUS_PLUGIN(Integrator, uniform, Uniform, "the baseline: equidistant steps of a given length")

}  // namespace pileus
