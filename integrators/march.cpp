/// The multilevel marcher: steps as long as the tolerance allows, empty space leapt over, sunlight from a
/// cache.
///
/// Rays walk the nodes of a pyramid of exact density ranges. In each node the step follows from the range,
/// from the transmittance left and from the tolerance; samples are composited by the midpoint rule with the
/// exact opacity of each step (METHODS §1.2, §9). Optical depth towards every sun comes from a lattice that
/// one sweep fills, as fine as a few pilot rays say is needed. Each ray estimates its own error from the
/// curvature of its samples and is marched again, finer, where that is too large.
///
/// Seen from afar, a grid may on demand be read at a coarser level: half the resolution, or a quarter, as far
/// as a pixel is wide and as pilot rays, marched with and without, say that it does not matter.
///
/// The tolerance is shared out: half for the sun's cache, four tenths for the steps and what the cache does
/// not need, a tenth for ending rays early; where levels come into question they get 0.15 of it, from the
/// cache and the steps. A ray that
/// misses the tolerance all the same, by its own estimate, goes to `exact`. Depths (aov Z) are as good as the
/// voxels that were read. Media lit by suns are marched, with solids and their shadows among them; those of
/// analytic media (fog, haze) are known in closed form, and marched in as far as grids and solids shade them.
/// Lights at a finite distance are marched as suns are, in grids that stand but once and that no solid
/// shades; scenes in which they light other media, and all with tolerance 0, go to `exact`.
///
/// With the AOV `error_bound`, every ray comes with a proven bound of its error: docs/error_bound.md.
///
///   leaping     skip empty nodes and adapt steps to nodes; false: as if every node were the densest
///   sun_cache   take sunlight from the cache where it is accurate enough; false: a shadow ray per sample
///   level_of_detail
///               read grids at coarser levels where the picture is the same. Off by default: making the
///               levels costs more than they save in one picture. Not with error_bound, which is about the
///               finest
///   storage     "16-bit" densities take half the memory of "float" ones, half the time to read and a quarter
///               of that to build; "auto" takes them where they err by less than a twentieth of the
///               tolerance
///
///   [render]
///   integrator = "march"
///   tolerance = 0.002
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "integrators/clear_view.h"
#include "integrators/exact_tracer.h"
#include "integrators/kernels/march_kernel.h"
#include "integrators/level_of_detail.h"
#include "integrators/lighting.h"
#include "integrators/march_fog.h"
#include "integrators/march_options.h"
#include "integrators/march_packet.h"
#include "integrators/march_scene.h"
#include "integrators/packet_bounds.h"
#include "integrators/ray_ends.h"
#include "integrators/solid_shadows.h"
#include "integrators/sunlight.h"
#include "lib/core/build_features.h"
#include "lib/core/error.h"
#include "lib/core/parallel.h"
#include "lib/core/param_table.h"
#include "lib/math/transmittance.h"
#include "lib/scene/integrator.h"

namespace pileus {
namespace {

/// Of the tolerance; they add up to 1.
struct Shares {
  double step = 0.4, cache = 0.5, level = 0.0;
  static constexpr double stop = 0.1;
};
constexpr Shares kSharesWithLevels{0.33, 0.42, 0.15};

constexpr double kStorageShare = 0.05;  ///< what densities in 16 bits may err by, of the share of steps

/// The kernel's estimate of its step error is right on average; the worst of many pixels err about twice as
/// much.
constexpr double kEstimateSafety = 2.0;

constexpr double kFirstQuality = 20.0;  ///< of steps at first try: so that few rays need another
constexpr double kFogShare = 0.02;      ///< what tables of fog may err by, in front of opaque media
constexpr double kHazeShare = 0.02;     ///< what hazes' optical depths towards suns may err by
constexpr double kBoundShare = 0.05;    ///< a bound need not be narrower

double largest(const Rgb& rgb) {
  return std::max({rgb.x, rgb.y, rgb.z});
}

HazeRays haze_rays(const World& world, const MarchWorld& march, double tolerance) {
  Box3d bounds;
  std::vector<Box3d> grids;
  for (const WorldMedium& medium : world.media) {
    bounds.extendBy(medium.density->bounds());
    if (medium.density->has_bricks()) grids.push_back(medium.density->bounds());
  }
  return HazeRays(march.hazes(), grids, march.suns(), bounds, kHazeShare * tolerance);
}

class MarchTracer final : public Tracer {
 public:
  MarchTracer(const World& world, const EffectPlan& plan, const Accuracy& accuracy,
              const MarchOptions& options)
      : m_world(world),
        m_plan(plan),
        m_promise(accuracy.tolerance * accuracy.coarseness),
        m_tolerance(plan.secondary_rays() ? 0.5 * m_promise : m_promise),
        m_ends(world, plan, accuracy),
        m_fog(world, m_tolerance, accuracy.picture),
        m_march(world, plan, options.storage_for(kStorageShare * m_tolerance)),
        m_hazes(haze_rays(world, m_march, m_tolerance)),
        m_exact(prepare_exact(world, plan, accuracy)) {
    MarchScene& kernel = m_march.kernel;
    kernel.is_leaping = options.leaping;
    kernel.wants_depth = kHasAovs && plan.aovs.count("Z") > 0;
    const std::vector<int> levels = kHasLevelOfDetail && options.level_of_detail && !wants_bound(plan) &&
                                            m_march.has_levels() && has_size(accuracy.picture)
                                        ? coarsest_levels(world, accuracy.picture)
                                        : std::vector<int>{};
    const bool has_levels = std::any_of(levels.begin(), levels.end(), [](int level) { return level > 0; });
    if (has_levels) m_shares = kSharesWithLevels;
    m_choices = m_march.storage_choices();
    if (!m_fog.choice().empty()) m_choices.push_back(m_fog.choice());
    if (plan.fog) m_shares.step -= kFogShare;
    m_shares.step -= std::min(m_march.storage_error_in_view() / m_tolerance, kStorageShare);
    const double for_sunlight = plan.scattering ? choose_sunlight(accuracy.picture, options) : m_shares.cache;
    if (has_levels) choose_levels(accuracy.picture, levels);
    give_rest_to_steps(for_sunlight);  // after the levels, which pilots with the shorter steps tell better
    if (wants_bound(plan)) prepare_bound();
    if (plan.scattering && plan.surface_shadows) prepare_shadows();
  }

  size_t rays_per_call() const override {
    if (m_enclosed) return 16;
    return m_march.kernel.shadow_step > 0.0 ? 64 : 256;
  }

  bool traces_packets() const override { return true; }

  std::optional<RayResult> seen_alike(const Beam& beam) const override {
    if (m_plan.surfaces || m_plan.fog || m_enclosed || !is_clear(m_march.kernel, m_march.media(), beam))
      return {};
    return m_ends.uniform_background();
  }

  std::vector<std::string> choices() const override { return m_choices; }

  void trace(std::span<const Ray> rays, std::span<RayResult> results, Counters& counters) const override {
    if (rays.empty()) return;
    if (m_plan.surfaces || m_plan.fog || m_enclosed) return trace_all(rays, results, counters);
    constexpr size_t kTogether = kMostClear * kClearRays;
    for (size_t first = 0; first < rays.size(); first += kTogether) {
      const size_t count = std::min(kTogether, rays.size() - first);
      trace_where_not_clear(rays.subspan(first, count), results.subspan(first, count), counters);
    }
  }

 private:
  /// Traces runs of blocks together, except for those that see the background alone.
  void trace_where_not_clear(std::span<const Ray> rays, std::span<RayResult> results,
                             Counters& counters) const {
    std::array<char, kMostClear> clear;
    const size_t blocks = (rays.size() + kClearRays - 1) / kClearRays;
    find_clear(m_march.kernel, m_march.media(), rays, std::span(clear).first(blocks));
    for (size_t block = 0, next = 0; block < blocks; block = next) {
      while (next < blocks && clear[next] == clear[block]) ++next;
      const size_t first = block * kClearRays, count = std::min(next * kClearRays, rays.size()) - first;
      const auto run = rays.subspan(first, count);
      const auto seen = results.subspan(first, count);
      if (clear[block] != 0)
        show_background(run, seen);
      else
        trace_all(run, seen, counters);
    }
  }

  void trace_all(std::span<const Ray> rays, std::span<RayResult> results, Counters& counters) const {
    TraceCounters tile;
    MarchPacket packet = trace_packet(rays, {}, results, tile);
    counters["exact_rays"] += 0;  // told also where there are none
    for (size_t i = 0; i < rays.size(); ++i) {
      if (!is_good(results[i])) hand_over(rays[i], results[i], counters);
    }
    if (m_enclosed) {
      prove_bounds(*m_enclosed, m_fog, kBoundShare * m_tolerance, packet, results);
      counters["bound_samples"] += packet.bound_samples;
      counters["bound_lookups"] += packet.bound_lookups;
    }
    tile.add_to(counters);
  }

  /// Traces rays that come by these paths; none given: from the camera.
  MarchPacket trace_packet(std::span<const Ray> rays, std::span<const RayPath> paths,
                           std::span<RayResult> results, TraceCounters& tile) const {
    MarchPacket packet(rays, m_march, m_plan.surfaces, m_shadows.has_value());
    if (m_plan.surfaces) packet.find_hits(m_world, sights(rays.size(), paths), paths.empty());
    if (m_plan.fog) packet.add_fog(m_fog, paths.empty());
    SecondaryRays next;
    for (size_t first = 0; first < rays.size(); first += kPacketRays) {
      const size_t end = std::min(first + kPacketRays, rays.size());
      for (size_t i = first; i < end; ++i)
        find_end(packet, i, paths.empty() ? RayPath{} : paths[i], tile, &next);
      if (!next.rays.empty()) trace_on(packet, next, tile);
    }
    for (size_t i = 0; i < rays.size(); ++i) prepare_ray(packet, i, tile);
    if (m_shadows) tile.surface_shadow_rays += find_shadows(packet);
    march_packet(m_march.kernel, packet);
    refine_packet(m_march.kernel, m_shares.step * m_tolerance / kEstimateSafety, packet);
    count_work(packet, tile);
    for (size_t i = 0; i < rays.size(); ++i) results[i] = finish_ray(packet, i);
    return packet;
  }

  /// How wide pixels are along rays that come by these paths; none given: from the camera. Shadow rays see
  /// no less of a surface than these, where they start on it.
  std::vector<RaySight> sights(size_t rays, std::span<const RayPath> paths) const {
    std::vector<RaySight> seen(rays, m_ends.sight({}));
    for (size_t i = 0; i < paths.size(); ++i) seen[i] = m_ends.sight(paths[i]);
    return seen;
  }

  /// Traces the rays and adds what they see to the ends of those that they come from.
  void trace_on(MarchPacket& packet, SecondaryRays& next, TraceCounters& tile) const {
    std::vector<RayResult> seen(next.rays.size());
    MarchPacket on = trace_packet(next.rays, next.paths, seen, tile);
    for (size_t n = 0; n < seen.size(); ++n) {
      packet.behind[next.parents[n]] += next.weights[n] * seen[n].radiance;
      packet.behind_error[next.parents[n]] += largest(next.weights[n]) * seen[n].error;
    }
    if (m_enclosed) {
      prove_bounds(*m_enclosed, m_fog, kBoundShare * m_tolerance, on, seen);
      add_bounds(on, next, seen, packet);
    }
    next = {};
  }

  void show_background(std::span<const Ray> rays, std::span<RayResult> results) const {
    for (size_t i = 0; i < rays.size(); ++i) {
      results[i] = {};
      results[i].radiance = m_ends.background(rays[i].d);
      results[i].error = 0.0;
    }
  }

  /// Returns the share of the tolerance that this took.
  double choose_sunlight(const Vec2i& picture, const MarchOptions& options) {
    constexpr double kMostBytes = 512e6;
    const SunlightChoice choice = pileus::choose_sunlight(m_world, picture, m_shares.cache * m_tolerance,
                                                          options.sun_cache ? kMostBytes : 0.0, m_march);
    m_sunlight = choice;
    m_choices.push_back("sunlight: " + choice.reason);
    return choice.error / m_tolerance;
  }

  /// What sunlight leaves of its share lengthens the steps, a little more than its share shortens them. The
  /// errors of hazes are told less well: they keep it in reserve.
  void give_rest_to_steps(double used) {
    constexpr double kMostOfSteps = 0.2;
    const double rest = m_hazes.any() ? std::min(m_shares.cache - used, 0.0) : m_shares.cache - used;
    m_shares.step += std::max(rest, -kMostOfSteps * m_shares.step);
  }

  void prepare_shadows() {
    constexpr double kDepthPerTolerance = 15.0;
    SolidShadows shadows(m_world, kDepthPerTolerance * m_tolerance);
    if (shadows.any()) m_shadows.emplace(std::move(shadows));
  }

  void prepare_bound() {
    m_enclosed = std::make_unique<EnclosedWorld>(m_world, m_plan, m_march);
    m_choices.push_back(
        fmt::format("error_bound: proven ray by ray, with {:.1f} MB of what the grids' curvature can do",
                    1e-6 * double(m_enclosed->memory_bytes())));
  }

  static bool has_size(const Vec2i& picture) { return picture.x > 0 && picture.y > 0; }

  /// After the sunlight: lattices keep the depths of the finest voxels, and shadow rays are to have them.
  void choose_levels(const Vec2i& picture, const std::vector<int>& coarsest) {
    if (m_march.kernel.shadow_step > 0.0) {
      m_choices.push_back("density at the finest level: shadow rays read it");
    } else {
      const LevelChoice choice = pileus::choose_levels(
          m_world, picture, m_shares.level * m_tolerance, coarsest,
          [&](std::span<const Ray> rays) { return march_pilots(rays); }, m_march);
      m_level_error = choice.error;
      m_choices.insert(m_choices.end(), choice.reasons.begin(), choice.reasons.end());
      if (choice.is_coarser) return;
    }
    m_shares.step += Shares().step - kSharesWithLevels.step;
  }

  /// With steps whose errors are small beside what is compared.
  std::vector<RayResult> march_pilots(std::span<const Ray> rays) const {
    constexpr double kFiner = 1.0 / 32.0;
    constexpr size_t kRaysPerTask = 16;
    std::vector<RayResult> results(rays.size());
    parallel_for((rays.size() + kRaysPerTask - 1) / kRaysPerTask, [&](size_t task) {
      const size_t first = task * kRaysPerTask, count = std::min(kRaysPerTask, rays.size() - first);
      MarchPacket packet(rays.subspan(first, count), m_march, m_plan.surfaces);
      if (m_plan.surfaces) packet.find_hits(m_world, sights(count, {}), false);
      if (m_plan.fog) packet.add_fog(m_fog, true);
      TraceCounters counters;
      for (size_t i = 0; i < count; ++i) {
        find_end(packet, i, {}, counters, nullptr);
        prepare_ray(packet, i, counters);
        packet.jobs[i].step_quality *= kFiner;
        packet.jobs[i].stop *= kFiner;
      }
      march_packet(m_march.kernel, packet);
      for (size_t i = 0; i < count; ++i) results[first + i] = finish_ray(packet, i);
    });
    return results;
  }

  /// Where a ray ends and what it sees there. `next` gets the rays that go on; null: none is followed.
  void find_end(MarchPacket& packet, size_t i, const RayPath& path, TraceCounters& tile,
                SecondaryRays* next) const {
    const Ray& ray = packet.rays[i];
    MarchRay& job = packet.jobs[i];
    job.ray = ray;
    job.segment = {0.0, std::numeric_limits<double>::infinity()};
    const std::optional<WorldHit> hit = m_plan.surfaces ? packet.hits[i] : std::nullopt;
    if (hit) job.segment.t1 = hit->t;
    const auto depth = [&](const Ray& shadow, Segment segment) {
      double tau = 0.0;
      for (const WorldMedium& medium : m_world.media) {
        tau += medium.extinction * medium.density->column(shadow, segment, kOpaque, tile.shadow);
      }
      return tau;
    };
    const auto go_on = [&](const SecondaryRay& on) {
      if (next) next->add(on, on.weight, i);
      return Rgb(0.0);
    };
    packet.behind[i] = m_ends.radiance(ray, hit, path, 1.0, tile, depth, go_on);
  }

  void prepare_ray(MarchPacket& packet, size_t i, TraceCounters& tile) const {
    const Ray& ray = packet.rays[i];
    MarchRay& job = packet.jobs[i];
    job.weights = packet.weights.data() + i * packet.weights_step;
    double media = packet.weights_step == 0 ? packet.brightest : m_march.brightest(job.weights);
    if (m_march.has_lamps()) {
      const LampLight lamps = m_march.lamplight(ray, job.segment);
      media += lamps.brightest;
      job.lamplight = lamps.brightest, job.lamp_rounding = lamps.rounding;
    }
    if (m_plan.fog) media = add_fog(m_world, kFogShare * m_tolerance, media, packet, i, tile);
    job.behind = largest(packet.behind[i]);
    job.brightest = std::max(job.behind, media);
    job.step_quality = kFirstQuality * m_shares.step * m_tolerance / std::max(job.brightest, 1e-3);
    job.stop = Shares::stop * m_tolerance / std::max(1.0, job.brightest);
    m_march.set_height(ray, job);
    if (m_hazes.any()) m_hazes.place(job, packet.hazes[i]);
  }

  /// Returns the number of shadow rays this took.
  uint64_t find_shadows(MarchPacket& packet) const {
    const size_t suns = m_march.suns().size();
    uint64_t shadow_rays = 0;
    for (size_t first = 0; first < packet.jobs.size(); first += kPacketRays) {
      const size_t count = std::min(kPacketRays, packet.jobs.size() - first);
      const std::span<MarchRay> rays = std::span(packet.jobs).subspan(first, count);
      if (m_plan.holes) {
        packet.dappled.resize(packet.jobs.size());
        m_shadows->mark_dappled(rays, std::span(packet.dappled).subspan(first, count));
      }
      shadow_rays += m_shadows->find(rays, std::span(packet.lit).subspan(first * suns, count * suns));
    }
    return shadow_rays;
  }

  /// The tolerance is a promise: where steps or sunlight cannot be made fine enough, `exact` has to keep it.
  /// (Pilot rays march while the levels are being chosen: nobody relies on them.)
  bool is_good(const RayResult& result) const {
    const double sum = result.radiance.x + result.radiance.y + result.radiance.z;
    return result.error <= m_promise * (1.0 + 1e-6) && std::isfinite(sum);
  }

  void hand_over(const Ray& ray, RayResult& result, Counters& counters) const {
    m_exact->trace({&ray, 1}, {&result, 1}, counters);
    ++counters["exact_rays"];
  }

  void count_work(const MarchPacket& packet, TraceCounters& tile) const {
    tile.camera.density_samples += packet.samples;
    tile.camera.leaps += packet.leaps;
    tile.source_samples += packet.samples * (m_plan.scattering ? 1 : 0);
    tile.ambient_samples += packet.samples * (m_plan.ambient ? 1 : 0);
    tile.shadow.density_samples += packet.lookups;
    tile.media_shadow_rays += packet.lookups;
  }

  RayResult finish_ray(const MarchPacket& packet, size_t i) const {
    const MarchResult& marched = packet.marched[i];
    const double passed = transmittance(marched.tau);
    RayResult result;
    result.radiance = m_march.radiance(packet.sums.data() + i * packet.stride) + passed * packet.behind[i];
    result.transmittance = passed;
    if (m_plan.fog) {
      result.radiance += packet.fogs[i].light;
      result.transmittance *= packet.fog_ends[i];
    }
    result.z_first = z_first(packet.rays[i], marched.first);
    result.z_half = marched.z_half;
    if (m_plan.surfaces && packet.hits[i]) {
      result.transmittance = 0.0;
      result.z_first = std::min(result.z_first, packet.hits[i]->t);
      result.z_half = std::min(result.z_half, packet.hits[i]->t);
    }
    const double stop_error = passed <= packet.jobs[i].stop ? Shares::stop * m_tolerance : 0.0;
    const MarchRay& job = packet.jobs[i];
    const double light = m_march.has_lamps() ? m_march.light(packet.sums.data() + i * packet.stride) : 0.0;
    const double in_view = std::max(job.behind, job.brightest - job.lamplight) + light;
    const double value_error = passed < 1.0 ? m_level_error + m_march.storage_error(in_view) : 0.0;
    const double haze_error =
        m_hazes.any() ? (1.0 - passed) * packet.hazes[i].depth_error * job.brightest : 0.0;
    const double sunlit = packet.weights_step == 0 ? packet.sunlit : m_march.sunlit(job.weights);
    const double cache_error = m_sunlight.error_of(1.0 - passed, sunlit, light);
    result.error = kEstimateSafety * marched.error + cache_error + haze_error + stop_error + value_error +
                   job.lamp_rounding;
    if (m_plan.secondary_rays()) result.error += passed * packet.behind_error[i];
    if (m_plan.fog) result.error += (1.0 - passed) * packet.fog_errors[i];
    const bool is_unreadable = m_hazes.any() && !packet.hazes[i].is_readable,
               is_dappled = !packet.dappled.empty() && packet.dappled[i];
    if (is_unreadable || is_dappled) result.error = std::numeric_limits<double>::infinity();
    result.samples = marched.samples + marched.lookups;
    return result;
  }

  /// Where the medium begins; looked up between the samples only for a picture that shows it.
  double z_first(const Ray& ray, const Segment& first) const {
    if (!std::isfinite(first.t1)) return first.t1;
    if (m_plan.aovs.count("Z") == 0) return 0.5 * (first.t0 + first.t1);
    double z = first.t1;
    std::vector<DensityPiece> pieces;
    FieldCounters counters;
    for (const WorldMedium& medium : m_world.media) {
      pieces.clear();
      medium.density->append_pieces(ray, first, pieces, counters);
      if (!pieces.empty()) z = std::min(z, pieces.front().t0);
    }
    return z;
  }

  static constexpr double kOpaque = 1e3;

  const World& m_world;
  const EffectPlan& m_plan;
  double m_promise;    ///< the tolerance
  double m_tolerance;  ///< of each ray; half of it where rays go on: they err, too
  RayEnds m_ends;
  FogSetup m_fog;
  MarchWorld m_march;
  HazeRays m_hazes;
  std::unique_ptr<const EnclosedWorld> m_enclosed;  ///< where a bound is asked for
  std::optional<SolidShadows> m_shadows;            ///< where solids shade media
  std::unique_ptr<const Tracer> m_exact;            ///< for rays that miss the tolerance
  Shares m_shares;
  SunlightChoice m_sunlight;
  double m_level_error = 0.0;  ///< of reading grids at coarser levels, for a pixel that shows a medium
  std::vector<std::string> m_choices;
};

struct March final : Integrator {
  MarchOptions options;

  void describe(ParamTable& params) override { options.describe(params); }

  bool has_level_of_detail() const override { return options.level_of_detail; }

  std::unique_ptr<const Tracer> prepare(const World& world, const EffectPlan& plan,
                                        const Accuracy& accuracy) const override {
    const std::string obstacle =
        accuracy.tolerance > 0.0 ? MarchWorld::obstacle(world, plan) : "the tolerance is 0";
    if (obstacle.empty()) return std::make_unique<MarchTracer>(world, plan, accuracy, options);
    return hand_over_all(world, plan, accuracy, obstacle);
  }
};

}  // namespace

PILEUS_PLUGIN(Integrator, march, March, "the default: steps and caches as coarse as the tolerance allows")

}  // namespace pileus
