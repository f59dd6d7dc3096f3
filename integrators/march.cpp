/// The multilevel marcher: steps as long as the tolerance allows, empty space leapt over, sunlight from a
/// cache.
///
/// Rays walk the nodes of a pyramid of exact density ranges. In each node the step follows from the range,
/// from the transmittance left and from the tolerance; samples are composited by the midpoint rule with the
/// exact opacity of each step (METHODS §1.2, §9). Optical depth towards every sun comes from a lattice that
/// one sweep fills. Each ray estimates its own error from the curvature of its samples and is marched again,
/// finer, where that is too large.
///
/// Grids lit by suns are marched. For scenes with analytic media, lights at a finite distance or solids that
/// cast shadows into media, and for tolerance 0, rays go to `exact`.
///
///   [render]
///   integrator = "march"
///   tolerance = 0.002
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "integrators/kernels/march_kernel.h"
#include "integrators/lighting.h"
#include "integrators/sun_lattice.h"
#include "lib/core/error.h"
#include "lib/core/param_table.h"
#include "lib/scene/integrator.h"

namespace pileus {
namespace {

double largest(const Rgb& rgb) {
  return std::max({rgb.x, rgb.y, rgb.z});
}

/// What the kernels need of a world, made once per render.
class MarchWorld {
 public:
  MarchWorld(const World& world, const EffectPlan& plan, double tolerance) : m_world(world), m_plan(plan) {
    for (const WorldMedium& medium : world.media) add_grid(medium);
    if (plan.scattering) add_lights();
    kernel.stop = tolerance / 8.0;
    kernel.step_quality = (getenv("PQ") ? atof(getenv("PQ")) : 20.0) * tolerance;
  }

  MarchScene kernel;

  /// Colours of the sums: radiance per unit of sums[grid][2 + light].
  Rgb light_colour(size_t grid, size_t light) const {
    return m_colours[grid * size_t(kernel.lights) + light];
  }

  /// Phase weights of a ray, [grid][light][kMostTerms], times the light's strongest channel.
  void weights_for(const Vec3d& direction, std::vector<float>& weights) const {
    weights.resize(kernel.grids.size() * size_t(kernel.lights) * kMostTerms);
    for (size_t g = 0; g < kernel.grids.size(); ++g) {
      const WorldMedium& medium = m_world.media[g];
      for (size_t l = 0; l < size_t(kernel.lights); ++l) {
        const size_t at = g * size_t(kernel.lights) + l;
        const double p = medium.phase->p(-direction, m_suns[l].wi);
        for (size_t k = 0; k < medium.scattering.size(); ++k) {
          weights[at * kMostTerms + k] = float(phase_weight(medium.scattering[k], p) * m_strengths[at]);
        }
      }
    }
  }

 private:
  void add_grid(const WorldMedium& medium) {
    MarchGrid grid;
    m_pyramids.push_back(std::make_unique<BrickPyramid>(*medium.density->bricks()));
    grid.pyramid = m_pyramids.back().get();
    const Vec3d origin(grid.pyramid->origin());
    grid.local_from_world = Affine::translation(-origin) * medium.density->index_from_world();
    grid.bounds = Box3d(Vec3d(grid.pyramid->grid().lo()) - origin, Vec3d(grid.pyramid->grid().hi()) - origin);
    grid.extinction = medium.extinction;
    grid.terms = int(medium.scattering.size());
    for (size_t k = 0; k < medium.scattering.size(); ++k)
      grid.term_extinction[k] = float(medium.scattering[k].extinction);
    kernel.several_terms |= grid.terms > 1;
    kernel.height_light |= medium.ambient.top != medium.ambient.bottom;
    kernel.grids.push_back(grid);
  }

  void add_lights() {
    kernel.lights = int(m_world.lights.size());
    for (const auto& light : m_world.lights) m_suns.push_back(light->at(Vec3d(0.0)));
    for (const WorldMedium& medium : m_world.media) {
      for (const Illumination& sun : m_suns) {
        const Rgb colour = medium.albedo * sun.irradiance;
        const double strength = largest(colour);
        m_strengths.push_back(strength);
        m_colours.push_back(strength > 0.0 ? colour / strength : Rgb(0.0));
      }
    }
    for (const Illumination& sun : m_suns) {
      for (const MarchGrid& grid : kernel.grids)
        kernel.lattices.push_back(build_sun_lattice(grid, sun.wi, getenv("PS") ? atof(getenv("PS")) : 2.0));
    }
  }

  const World& m_world;
  const EffectPlan& m_plan;
  std::vector<std::unique_ptr<BrickPyramid>> m_pyramids;
  std::vector<Illumination> m_suns;
  std::vector<double> m_strengths;  ///< [grid][light]: strongest channel of albedo * irradiance
  std::vector<Rgb> m_colours;       ///< the same, divided by its strongest channel
};

class MarchTracer final : public Tracer {
 public:
  MarchTracer(const World& world, const EffectPlan& plan, double tolerance)
      : m_world(world), m_plan(plan), m_tolerance(tolerance), m_march(world, plan, tolerance) {}

  size_t rays_per_call() const override { return 256; }

  void trace(std::span<const Ray> rays, std::span<RayResult> results, Counters& counters) const override {
    TraceCounters tile;
    std::vector<MarchRay> jobs(rays.size());
    std::vector<float> weights;
    m_march.weights_for(rays[0].d, weights);
    for (size_t i = 0; i < rays.size(); ++i) {
      jobs[i].ray = rays[i];
      jobs[i].segment = {0.0, std::numeric_limits<double>::infinity()};
      jobs[i].weights = weights.data();
    }
    const size_t stride = m_march.kernel.grids.size() * sums_per_grid(m_march.kernel);
    std::vector<double> sums(rays.size() * stride);
    std::vector<MarchResult> marched(rays.size());
    march_rays(m_march.kernel, jobs, marched, sums);
    for (size_t i = 0; i < rays.size(); ++i) {
      RayResult& result = results[i];
      result = {};
      result.transmittance = transmittance(marched[i].tau);
      for (size_t l = 0; l < size_t(m_march.kernel.lights); ++l) {
        result.radiance += m_march.light_colour(0, l) * sums[i * stride + 2 + l];
      }
      result.radiance += result.transmittance * m_world.background->radiance(rays[i].d);
      result.error = marched[i].error;
      result.samples = marched[i].samples + marched[i].lookups;
      tile.camera.density_samples += marched[i].samples;
      tile.shadow.density_samples += marched[i].lookups;
      tile.camera.leaps += marched[i].leaps;
    }
    tile.add_to(counters);
  }

 private:
  const World& m_world;
  const EffectPlan& m_plan;
  double m_tolerance;
  MarchWorld m_march;
};

struct March final : Integrator {
  void describe(ParamTable&) override {}

  std::unique_ptr<const Tracer> prepare(const World& world, const EffectPlan& plan,
                                        const Accuracy& accuracy) const override {
    auto tracer = std::make_unique<MarchTracer>(world, plan, accuracy.tolerance * accuracy.coarseness);
    return tracer;
  }
};

}  // namespace

PILEUS_PLUGIN(Integrator, march, March, "the multilevel marcher: as fast as the tolerance allows")

}  // namespace pileus
