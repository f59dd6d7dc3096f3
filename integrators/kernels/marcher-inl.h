// The march of one ray.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_MARCHER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_MARCHER_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_MARCHER_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_MARCHER_INL_H
#endif

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "hwy/highway.h"

#include "integrators/kernels/lanes-inl.h"
#include "integrators/kernels/readers-inl.h"
#include "integrators/kernels/walks-inl.h"
#include "lib/math/transmittance.h"
#include "lib/simd/exponential-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Marches one ray after the other.
///   kGrids:  1, with extinction; or 0: any
///   kLights: 0 or 1; or -1: any
///   kPlain:  one scatter term, and no light that varies with height
template <int kGrids, int kLights, bool kPlain>
class Marcher {
 public:
  explicit Marcher(const MarchScene& scene) : m_scene(scene) {
    for (const MarchGrid& grid : scene.grids) m_grids.emplace_back(*grid.pyramid);
    for (const SunLattice& lattice : scene.lattices) m_lattices.emplace_back(lattice);
    m_paths.resize(m_grids.size());
    m_sun_paths.resize(m_lattices.size());
    for (const MarchGrid& grid : scene.grids) m_extinctions.push_back(float(grid.extinction));
    m_rhos.resize(m_grids.size() * kLanes);
    m_accumulators.resize(m_grids.size() * sums_per_grid(scene) * kLanes);
  }

  void march(const MarchRay& job, MarchResult& result, double* sums) {
    begin(job);
    if constexpr (kGrids == 1) {
      const MarchGrid& grid = m_scene.grids[0];
      const Ray local = local_ray(grid, job.ray);
      const Segment inside = clip_to_bounds(grid.bounds, local, job.segment);
      if (inside.empty()) return miss(result, sums);
      clear_sums();
      walk_one(GridWalk(grid, local, inside));
    } else {
      clear_sums();
      walk_all(job);
    }
    finish(result, sums);
  }

  /// The answer for a ray that meets nothing.
  void miss(MarchResult& result, double* sums) const {
    result = {};
    result.z_half = std::numeric_limits<double>::infinity();
    result.first = {result.z_half, result.z_half};
    std::fill_n(sums, m_scene.grids.size() * sums_per_grid(m_scene), 0.0);
  }

 private:
  static constexpr bool kClamp = kGrids != 1;
  int grids() const { return kGrids > 0 ? kGrids : int(m_grids.size()); }
  int lights() const { return kLights >= 0 ? kLights : m_scene.lights; }

  void begin(const MarchRay& job) {
    m_job = &job;
    m_queued = 0;
    m_transmittance = 1.0;
    m_samples = m_lookups = m_leaps = 0;
    m_z_half = std::numeric_limits<double>::infinity();
    m_first = {m_z_half, m_z_half};
    m_has_met = false;
    m_is_placed = false;
  }

  void clear_sums() {
    const D d;
    hn::Store(hn::Zero(d), d, m_tau);
    hn::Store(hn::Zero(d), d, m_error2);
    std::fill(m_accumulators.begin(), m_accumulators.end(), 0.0f);
    for (SampleHistory* history : {&m_lit, &m_sigma, &m_bright, &m_weight}) history->reset();
  }

  /// Kernel positions are counted from the entry of the first medium: floats then suffice.
  void place_paths(double t) {
    m_t_base = t;
    m_is_placed = true;
    const Ray& ray = m_job->ray;
    const Vec3d p = ray.at(t);
    for (size_t g = 0; g < m_grids.size(); ++g) {
      const Affine& local = m_scene.grids[g].local_from_world;
      m_paths[g] = LinePath(local.point(p), local.direction(ray.d));
    }
    for (size_t i = 0; i < m_lattices.size(); ++i) {
      const Affine& lattice = m_scene.lattices[i].lattice_from_world;
      m_sun_paths[i] = LinePath(lattice.point(p), lattice.direction(ray.d));
    }
    m_height0 = float(m_job->height0 + t * m_job->height1);
    m_height1 = float(m_job->height1);
  }

  void walk_one(GridWalk walk) {
    const double extinction = walk.extinction(), scale = light_scale(m_scene.grids[0]);
    while (walk.next()) {
      const ValueRange& range = m_scene.is_leaping ? walk.now.range : walk.whole();
      if (range.hi == 0.0f) {
        ++m_leaps;
        continue;
      }
      const double sigma = extinction * double(range.hi), variation = scale * double(range.hi - range.lo);
      if (!add_stretch(walk.now.t0, walk.now.t1, sigma, variation, walk.voxel())) return;
    }
  }

  /// How much a density adds to a ray, relative to the brightest it can get [1/m]: by its extinction, or by
  /// what it glows.
  double light_scale(const MarchGrid& grid) const {
    if (!(grid.glow > grid.extinction * m_job->brightest)) return grid.extinction;
    return grid.glow / std::max(m_job->brightest, 1e-30);
  }

  /// Several grids: stretches end where those of any grid end.
  void walk_all(const MarchRay& job) {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    std::vector<GridWalk>& walks = m_walks;
    std::vector<double>& scales = m_light_scales;
    walks.clear();
    scales.clear();
    double t = kNever;
    for (const MarchGrid& grid : m_scene.grids) {
      const Ray local = local_ray(grid, job.ray);
      walks.emplace_back(grid, local, clip_to_bounds(grid.bounds, local, job.segment));
      scales.push_back(light_scale(grid));
      t = std::min(t, walks.back().now.t0);
    }
    while (t < kNever) {
      double end = kNever, sigma = 0.0, variation = 0.0, voxel = kNever;
      bool is_empty = true;
      for (size_t g = 0; g < walks.size(); ++g) {
        GridWalk& walk = walks[g];
        walk.pass(t);
        const bool has_begun = walk.now.t0 <= t;
        end = std::min(end, has_begun ? walk.now.t1 : walk.now.t0);
        if (!m_scene.is_leaping && has_begun) walk.now.range = walk.whole();
        if (!has_begun || walk.now.range.hi == 0.0f) continue;
        is_empty = false;
        sigma += walk.extinction() * double(walk.now.range.hi);
        variation += scales[g] * double(walk.now.range.hi - walk.now.range.lo);
        voxel = std::min(voxel, walk.voxel());
      }
      if (end == kNever) return;
      if (is_empty) {
        ++m_leaps;
      } else if (!add_stretch(t, end, sigma, variation, voxel)) {
        return;
      }
      t = end;
    }
  }

  /// Queues the samples of a stretch; false once the ray has ended. Two rules give the step: the density may
  /// vary so much, and the light inside a step may fall by so much, that the step errs by its share (METHODS
  /// §1.5, §9.2); both matter less behind what the ray has already met.
  bool add_stretch(double t0, double t1, double sigma, double variation, double voxel) {
    if (!m_is_placed) {
      place_paths(t0);
      m_first.t0 = t0;
    }
    const double span = t1 - t0;
    const double weight = m_transmittance / m_job->step_quality;
    const double rate2 = std::max(weight * variation / voxel, weight * sigma * sigma);
    const double finest = std::min(std::sqrt(rate2), 8.0 / voxel);
    const int steps = std::max(1, int(std::ceil(span * finest)));
    const D d;
    const float dt = float(span / steps), first = float(t0 - m_t_base);
    const V lane = hn::Iota(d, 0.5f);
    for (int done = 0; done < steps;) {
      const int room = int(kQueue - kLanes - m_queued), count = std::min(room, steps - done);
      for (int i = 0; i < count; i += int(kLanes)) {
        const V at = hn::Add(lane, hn::Set(d, float(done + i)));
        hn::StoreU(hn::MulAdd(at, hn::Set(d, dt), hn::Set(d, first)), d, m_t + m_queued + i);
        hn::StoreU(hn::Set(d, dt), d, m_dt + m_queued + i);
      }
      m_queued += size_t(count);
      done += count;
      if (!drain()) return false;
    }
    return true;
  }

  /// Works off full vectors and keeps the rest for later.
  bool drain() {
    const D d;
    size_t done = 0;
    for (; done + kLanes <= m_queued; done += kLanes) {
      composite(m_t + done, m_dt + done);
      m_samples += kLanes;
      if (m_transmittance <= m_job->stop) {
        m_queued = 0;
        return false;
      }
    }
    if (done > 0) {
      hn::StoreU(hn::LoadU(d, m_t + done), d, m_t);
      hn::StoreU(hn::LoadU(d, m_dt + done), d, m_dt);
      m_queued -= done;
    }
    return true;
  }

  /// One vector of samples, in order along the ray.
  HWY_INLINE void composite(const float* t_at, const float* dt_at) {
    const D d;
    const V t = hn::LoadU(d, t_at), dt = hn::LoadU(d, dt_at);
    if constexpr (kGrids == 1) {
      const V rho = density(0, t), sigma = hn::Mul(rho, hn::Set(d, m_extinctions[0]));
      if (!m_has_met) find_first(rho, t_at);
      const V tau = hn::Mul(sigma, dt), opacity = simd_opacity(d, tau);
      const V before = transmittance_before(opacity, t_at, dt_at);
      add_to(m_tau, tau);
      const V scattered = hn::Mul(before, opacity);
      const V response = add_scattered(0, scattered, t);
      const MarchGrid& grid = m_scene.grids[0];
      const V lit = hn::MulAdd(rho, hn::Set(d, float(grid.glow)), hn::Mul(sigma, response));
      add_error(lit, sigma, response, hn::Mul(before, dt));
    } else {
      composite_several(t_at, dt_at, t, dt);
    }
  }

  /// Where grids overlap their extinctions add up, and each scatters its share.
  void composite_several(const float* t_at, const float* dt_at, V t, V dt) {
    const D d;
    V sigma = hn::Zero(d), rho_sum = hn::Zero(d);
    for (int g = 0; g < grids(); ++g) {
      const V rho = density(g, t);
      hn::StoreU(rho, d, m_rhos.data() + size_t(g) * kLanes);
      sigma = hn::MulAdd(rho, hn::Set(d, m_extinctions[size_t(g)]), sigma);
      rho_sum = hn::Add(rho_sum, rho);
    }
    if (!m_has_met) find_first(rho_sum, t_at);
    const V tau = hn::Mul(sigma, dt), opacity = simd_opacity(d, tau);
    const V before = transmittance_before(opacity, t_at, dt_at);
    add_to(m_tau, tau);
    // Mean transmittance over a step: before * (1 - exp(-tau)) / tau.
    const V thin = hn::Set(d, 1e-12f);
    const V share = hn::IfThenElse(hn::Gt(tau, thin), hn::Div(opacity, hn::Max(tau, thin)), hn::Set(d, 1.0f));
    const V mean = hn::Mul(hn::Mul(before, share), dt);
    V lit = hn::Zero(d), glow = hn::Zero(d);
    for (int g = 0; g < grids(); ++g) {
      const V rho = hn::LoadU(d, m_rhos.data() + size_t(g) * kLanes), column = hn::Mul(mean, rho);
      add_to(sums_of(g), column);
      const V extinction = hn::Set(d, m_extinctions[size_t(g)]);
      lit = hn::MulAdd(hn::Mul(rho, extinction), add_scattered(g, hn::Mul(column, extinction), t), lit);
      glow = hn::MulAdd(rho, hn::Set(d, float(m_scene.grids[size_t(g)].glow)), glow);
    }
    const V bright = hn::Div(lit, hn::Max(sigma, hn::Set(d, 1e-30f)));
    add_error(hn::Add(lit, glow), sigma, bright, hn::Mul(before, dt));
  }

  HWY_INLINE V density(int grid, V t) const {
    const LinePath& path = m_paths[size_t(grid)];
    return m_grids[size_t(grid)].template read<kClamp>(path.at(0, t), path.at(1, t), path.at(2, t));
  }

  /// Adds what a grid scatters of each light and of the height-dependent sky; returns its response to all
  /// lights.
  HWY_INLINE V add_scattered(int grid, V scattered, V t) {
    const D d;
    V sum = hn::Zero(d);
    for (int l = 0; l < lights(); ++l) {
      const V response = response_of(grid, l, sun_depth(l, t));
      add_to(sums_of(grid) + size_t(2 + l) * kLanes, hn::Mul(scattered, response));
      sum = hn::Add(sum, response);
    }
    if constexpr (!kPlain) {
      const V mix = hn::MulAdd(t, hn::Set(d, m_height1), hn::Set(d, m_height0));
      add_to(sums_of(grid) + kLanes, hn::Mul(scattered, mix));
    }
    return sum;
  }

  float* sums_of(int grid) { return m_accumulators.data() + size_t(grid) * sums_per_grid(m_scene) * kLanes; }

  static HWY_INLINE void add_to(float* sum, V value) {
    const D d;
    hn::StoreU(hn::Add(hn::LoadU(d, sum), value), d, sum);
  }

  HWY_INLINE V sun_depth(int light, V t) {
    if constexpr (kGrids != 1) {
      if (m_scene.shadow_step > 0.0) return traced_depth(light, t);
    }
    const size_t first = size_t(light) * size_t(grids());
    V sum = lattice_depth(first, t);
    for (int g = 1; g < grids(); ++g) sum = hn::Add(sum, lattice_depth(first + size_t(g), t));
    return sum;
  }

  HWY_INLINE V lattice_depth(size_t lattice, V t) const {
    const LinePath& path = m_sun_paths[lattice];
    return m_lattices[lattice].read(path.at(0, t), path.at(1, t), path.at(2, t));
  }

  /// Shadow rays of all lanes in step, through every grid.
  V traced_depth(int light, V t) {
    const D d;
    V sum = hn::Zero(d);
    for (int g = 0; g < grids(); ++g) {
      if (m_extinctions[size_t(g)] > 0.0f) sum = hn::Add(sum, traced_depth(light, g, t));
    }
    return sum;
  }

  V traced_depth(int light, int grid, V t) {
    const D d;
    const MarchGrid& scene = m_scene.grids[size_t(grid)];
    const Vec3d towards = scene.local_from_world.direction(m_scene.towards_suns[size_t(light)]);
    const double ds = m_scene.shadow_step / length(towards);  // [m]
    V p[3], step[3];
    V most = hn::Set(d, std::numeric_limits<float>::max());  // steps until a lane leaves the grid
    for (int axis = 0; axis < 3; ++axis) {
      const float per_step = float(towards[axis] * ds);
      p[axis] = m_paths[size_t(grid)].at(axis, t);
      step[axis] = hn::Set(d, per_step);
      if (per_step == 0.0f) continue;
      const V exit = hn::Set(d, float(per_step > 0.0f ? scene.bounds.max[axis] : scene.bounds.min[axis]));
      most = hn::Min(most, hn::Div(hn::Sub(exit, p[axis]), step[axis]));
    }
    const float scale = float(scene.extinction * ds);
    const V enough = hn::Set(d, float(m_scene.enough_shadow) / scale);
    const int count = int(std::min(hn::GetLane(hn::MaxOfLanes(d, most)), 1e7f)) + 1;
    V sum = hn::Zero(d);
    int k = 0;
    for (; k < count; ++k) {
      const V at = hn::Set(d, float(k) + 0.5f);
      sum = hn::Add(sum, m_grids[size_t(grid)].read_or_skip(hn::MulAdd(at, step[0], p[0]),
                                                            hn::MulAdd(at, step[1], p[1]),
                                                            hn::MulAdd(at, step[2], p[2])));
      if (k % 8 == 7 && hn::AllTrue(d, hn::Ge(sum, enough))) break;
    }
    m_lookups += uint64_t(k) * kLanes;
    return hn::Mul(sum, hn::Set(d, scale));
  }

  HWY_INLINE V response_of(int grid, int light, V tau) const {
    const D d;
    const float* weights = m_job->weights + (size_t(grid) * size_t(lights()) + size_t(light)) * kMostTerms;
    if constexpr (kPlain) {
      return hn::Mul(hn::Set(d, weights[0]), simd_transmittance(d, tau));
    } else {
      const MarchGrid& terms = m_scene.grids[size_t(grid)];
      V sum = hn::Zero(d);
      for (int k = 0; k < terms.terms; ++k) {
        const V extinction = hn::Set(d, terms.term_extinction[size_t(k)]);
        sum = hn::MulAdd(hn::Set(d, weights[k]), simd_transmittance(d, hn::Mul(extinction, tau)), sum);
      }
      return sum;
    }
  }

  /// Transmittance in front of each lane. Over a vector the product of floats is good to a few ulp; from
  /// vector to vector it goes on in double (METHODS §1.4).
  HWY_INLINE V transmittance_before(V opacity, const float* t, const float* dt) {
    const D d;
    const V passed = m_lanes.rotate(m_lanes.running_product(hn::Sub(hn::Set(d, 1.0f), opacity)), 0);
    const V before = hn::Mul(hn::Set(d, float(m_transmittance)), m_lanes.shift(passed, hn::Set(d, 1.0f), 0));
    const double after = m_transmittance * double(hn::GetLane(passed));
    if (m_transmittance >= 0.5 && after < 0.5) find_half(before, opacity, t, dt);
    m_transmittance = after;
    return before;
  }

  /// Inside its step the density is taken as constant.
  void find_half(V before, V opacity, const float* t, const float* dt) {
    const D d;
    alignas(64) float passed[kLanes], stopped[kLanes];
    hn::Store(before, d, passed);
    hn::Store(opacity, d, stopped);
    size_t i = kLanes - 1;
    while (i > 0 && passed[i] < 0.5f) --i;
    const double depth = -std::log1p(-double(stopped[i])), wanted = std::log(2.0 * double(passed[i]));
    const double share = depth > 0.0 ? std::clamp(wanted / depth, 0.0, 1.0) : 0.5;
    m_z_half = m_t_base + double(t[i]) + (share - 0.5) * double(dt[i]);
  }

  /// Looks for the first density on the ray, between two samples.
  void find_first(V rho, const float* t) {
    alignas(64) float rhos[kLanes];
    hn::Store(rho, D(), rhos);
    for (size_t i = 0; i < kLanes; ++i) {
      const double here = m_t_base + double(t[i]);
      if (rhos[i] > 0.0f) {
        m_first.t1 = here;
        m_has_met = true;
        return;
      }
      m_first.t0 = here;
    }
  }

  /// The error of the midpoint rule is h^2/24 of the second derivative: differences of neighbouring samples
  /// measure it, in the lit density and, for the effect of a wrong optical depth on what lies behind, in the
  /// density. Errors of different steps are added like independent ones.
  HWY_INLINE void add_error(V lit, V sigma, V bright, V weight) {
    const D d;
    const V brightest = hn::Max(bright, hn::Set(d, float(m_job->behind)));
    const V e_lit = second_difference(m_lit, lit), e_sigma = second_difference(m_sigma, sigma);
    const V e = hn::Mul(m_weight.push(m_lanes, weight),
                        hn::MulAdd(m_bright.push(m_lanes, brightest), e_sigma, e_lit));
    hn::Store(hn::MulAdd(e, e, hn::Load(d, m_error2)), d, m_error2);
  }

  /// Of the sample before each lane and its two neighbours.
  HWY_INLINE V second_difference(SampleHistory& history, V now) const {
    V middle, first;
    history.push(m_lanes, now, middle, first);
    return hn::Abs(hn::Sub(hn::Add(first, now), hn::Add(middle, middle)));
  }

  void finish(MarchResult& result, double* sums) {
    if (m_queued > 0) composite_rest();
    result.tau = double(sum_of(m_tau));
    result.transmittance = m_transmittance;
    result.error = std::sqrt(double(sum_of(m_error2))) / 24.0;
    result.first = m_first;
    result.z_half = m_z_half;
    result.samples = m_samples;
    result.lookups = m_scene.shadow_step > 0.0 ? m_lookups : m_samples * uint64_t(lights());
    result.leaps = m_leaps;
    const size_t count = m_grids.size() * sums_per_grid(m_scene);
    for (size_t i = 0; i < count; ++i) sums[i] = double(sum_of(m_accumulators.data() + i * kLanes));
    // A grid alone scatters all that does not pass.
    if constexpr (kGrids == 1) sums[0] = opacity_from_tau(result.tau) / m_scene.grids[0].extinction;
  }

  /// The last samples, with steps of length 0 behind them.
  void composite_rest() {
    for (size_t i = m_queued; i < kLanes; ++i) m_t[i] = m_t[m_queued - 1], m_dt[i] = 0.0f;
    composite(m_t, m_dt);
    m_samples += m_queued;
    m_queued = 0;
  }

  static float sum_of(const float* lanes) {
    const D d;
    return hn::GetLane(hn::SumOfLanes(d, hn::LoadU(d, lanes)));
  }

  static constexpr size_t kQueue = 256;

  const MarchScene& m_scene;
  std::vector<GridReader> m_grids;
  std::vector<LatticeReader> m_lattices;
  std::vector<LinePath> m_paths, m_sun_paths;
  std::vector<float> m_extinctions;   ///< of each grid [1/m]
  std::vector<float> m_rhos;          ///< [grid][lane]: densities of the present vector
  std::vector<float> m_accumulators;  ///< [grid][sum][lane]
  std::vector<GridWalk> m_walks;      ///< of the present ray, one per grid
  std::vector<double> m_light_scales;
  const MarchRay* m_job = nullptr;
  bool m_is_placed = false;
  double m_t_base = 0.0, m_transmittance = 1.0, m_z_half = 0.0;
  Segment m_first;         ///< see MarchResult
  bool m_has_met = false;  ///< some density
  float m_height0 = 0.0f, m_height1 = 0.0f;
  size_t m_queued = 0;
  uint64_t m_samples = 0, m_lookups = 0, m_leaps = 0;
  alignas(64) float m_tau[kLanes], m_error2[kLanes];
  alignas(64) float m_t[kQueue + kLanes], m_dt[kQueue + kLanes];
  LaneShifter m_lanes;
  SampleHistory m_lit, m_sigma, m_bright, m_weight;
};

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
