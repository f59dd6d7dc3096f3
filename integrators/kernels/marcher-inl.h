// The march of a packet of rays.
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

#include "integrators/kernels/fog-inl.h"
#include "integrators/kernels/hazes-inl.h"
#include "integrators/kernels/history-inl.h"
#include "integrators/kernels/lattice_reader-inl.h"
#include "integrators/kernels/packet-inl.h"
#include "integrators/kernels/places-inl.h"
#include "integrators/kernels/readers-inl.h"
#include "integrators/kernels/shades-inl.h"
#include "integrators/kernels/shadow_rays-inl.h"
#include "integrators/kernels/walks-inl.h"
#include "lib/math/transmittance.h"
#include "lib/simd/exponential-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Marches one packet after the other. All rays of a packet take the same steps.
///   kGrids:  1, with extinction; or 0: any media, also with solids that shade them and fog in front of them
///   kLights: 0 or 1; or -1: any
///   kPlain:  one scatter term, and no light that varies with height
template <int kGrids, int kLights, bool kPlain>
class Marcher {
 public:
  explicit Marcher(const MarchScene& scene)
      : m_scene(scene),
        m_shades(lights()),
        m_hazes(scene.hazes.size(), lights()),
        m_grids(grid_readers(scene)),
        m_lattices(lattice_readers(scene.lattices)),
        m_places(scene, m_grids, m_lattices) {
    for (size_t i = 0; i < scene.media(); ++i) m_extinctions.push_back(float(scene.medium(i).extinction));
    if (!m_places.any()) {
      m_paths.resize(m_grids.size());
      m_sun_paths.resize(m_lattices.size());
      m_locals.resize(m_grids.size() * kPacketRays);
    }
    m_weights.resize(scene.media() * size_t(lights()) * (kPlain ? 1 : kMostTerms));
    m_sums.resize(scene.media() * sums_per_medium(scene));
    m_rhos.resize(scene.media());
    m_sun_depths.resize(size_t(lights()));
  }

  /// rays: at most kPacketRays; sums: [ray][medium][sum]
  void march(std::span<const MarchRay> rays, std::span<MarchResult> results, double* sums) {
    m_rays = rays;
    m_leaps = m_samples = m_lookups = 0;
    const Segment inside = find_entry();
    if (inside.empty()) return miss(results, sums);
    begin(inside);
    walk(inside);
    finish(results, sums);
  }

 private:
  static constexpr bool kClamp = true;  ///< the rays beside one in the grid may be outside
  static constexpr size_t kTermsKept = kPlain ? 1 : kMostTerms;
  static constexpr int kMostLevel = 8;   ///< slabs of 8 << level cells
  static constexpr int kFewSteps = 2;    ///< a slab that needs no more is not worth dividing
  static constexpr int kMostSteps = 32;  ///< between two looks at what is left of the rays

  int grids() const { return kGrids > 0 ? kGrids : int(m_grids.size()); }
  int media() const { return kGrids > 0 ? kGrids : int(m_scene.media()); }
  int lights() const { return kLights >= 0 ? kLights : m_scene.lights; }

  /// Beams of the packet in every grid, and where on the rays something may be met.
  Segment find_entry() {
    m_beams.clear();
    Segment inside{std::numeric_limits<double>::infinity(), 0.0}, wanted = inside;
    m_finest = std::numeric_limits<double>::infinity();
    if (m_places.any()) inside = m_places.enter(m_rays, m_finest);
    for (size_t g = 0; g < m_paths.size(); ++g) {
      const MarchGrid& grid = m_scene.grids[g];
      m_beams.emplace_back(grid, grid.local_from_world, m_rays, std::span(m_locals).subspan(g * kPacketRays));
      const Segment in_grid = m_beams.back().inside();
      inside = {std::min(inside.t0, in_grid.t0), std::max(inside.t1, in_grid.t1)};
      m_finest = std::min(m_finest, m_beams.back().voxel());
    }
    if constexpr (kGrids != 1) enter_hazes(inside);
    m_latest_start = 0.0;
    m_earliest_end = std::numeric_limits<double>::infinity();
    for (const MarchRay& job : m_rays) {
      wanted = {std::min(wanted.t0, job.segment.t0), std::max(wanted.t1, job.segment.t1)};
      m_latest_start = std::max(m_latest_start, job.segment.t0);
      m_earliest_end = std::min(m_earliest_end, job.segment.t1);
    }
    return {std::max(inside.t0, wanted.t0), std::min(inside.t1, wanted.t1)};
  }

  void enter_hazes(Segment& inside) {
    if (!m_hazes.any()) return;
    const Segment in_hazes = m_hazes.inside(m_rays);
    inside = {std::min(inside.t0, in_hazes.t0), std::max(inside.t1, in_hazes.t1)};
    constexpr double kSlabs = 16.0;
    if (m_grids.empty()) m_finest = inside.length() / (kSlabs * double(BrickGrid::kBrickCells));
    // Where a ray ends within little of a slab, slabs have to be as short.
    m_finest = std::min(m_finest, m_hazes.mean_free_path(m_scene, m_rays));
  }

  /// The answer for rays that meet nothing.
  void miss(std::span<MarchResult> results, double* sums) const {
    MarchResult nothing;
    nothing.z_half = std::numeric_limits<double>::infinity();
    nothing.first = {nothing.z_half, nothing.z_half};
    std::fill(results.begin(), results.end(), nothing);
    std::fill_n(sums, m_rays.size() * m_sums.size(), 0.0);
  }

  /// Kernel positions are counted from the entry of the first medium: floats then suffice.
  void begin(const Segment& inside) {
    m_base = inside.t0;
    m_quality = std::numeric_limits<double>::infinity();
    m_brightest = 0.0;
    for (size_t i = 0; i < kPacketRays; ++i) {
      // A packet that is not full has its last ray several times.
      const size_t ray = std::min(i, m_rays.size() - 1);
      const MarchRay& job = m_rays[ray];
      place(i, ray, job.ray);
      m_start.of[i] = float(job.segment.t0 - m_base);
      m_end.of[i] = float(std::min(job.segment.t1 - m_base, double(std::numeric_limits<float>::max())));
      m_behind.of[i] = float(job.behind);
      m_stop.of[i] = float(job.stop);
      m_quality = std::min(m_quality, job.step_quality);
      m_brightest = std::max(m_brightest, job.brightest);
      keep_weights(i, job);
      m_height0.of[i] = float(job.height0 + m_base * job.height1);
      m_height1.of[i] = float(job.height1);
    }
    m_tau.reset();
    m_passed.fill(1.0f);
    m_error2.fill(0.0f);
    for (PacketFloats& sum : m_sums) sum.fill(0.0f);
    m_history.reset();
    m_is_inside = false;
    if (m_scene.wants_depth) m_depths = {};
    if constexpr (kGrids != 1) {
      m_shades.begin(m_rays, m_base);
      m_fog.begin(m_rays, m_base);
      m_hazes.begin(m_rays, m_base);
      m_places.begin(m_base);
    }
  }

  void place(size_t lane, size_t ray, const Ray& world) {
    for (size_t g = 0; g < m_paths.size(); ++g) {
      const Ray& local = m_locals[g * kPacketRays + ray];
      m_paths[g].set(lane, local.at(m_base), local.d);
    }
    for (size_t i = 0; i < m_sun_paths.size(); ++i) {
      const Affine& lattice = m_scene.lattices[i].lattice_from_world;
      m_sun_paths[i].set(lane, lattice.point(world.at(m_base)), lattice.direction(world.d));
    }
  }

  void keep_weights(size_t lane, const MarchRay& job) {
    for (size_t source = 0; source < size_t(media() * lights()); ++source) {
      const size_t terms = kPlain ? 1 : size_t(m_scene.medium(source / size_t(lights())).terms);
      for (size_t k = 0; k < terms; ++k)
        m_weights[source * kTermsKept + k].of[lane] = job.weights[source * kMostTerms + k];
    }
  }

  /// Slab by slab: twice as long behind one in which nothing was met or few steps sufficed, half as long
  /// where there is more to see.
  void walk(const Segment& inside) {
    int level = 0;
    for (double t = inside.t0; t < inside.t1;) {
      const double end = std::min(t + double(BrickGrid::kBrickCells << level) * m_finest, inside.t1);
      const Slab slab = look_ahead(t, end);
      if (slab.is_empty) {
        ++m_leaps;
        if (m_is_inside) leave_medium();
      } else {
        const int steps = steps_for(slab, end - t);
        const bool is_fine = double(end - t) <= double(BrickGrid::kBrickCells) * slab.voxel;
        if (level > 0 && steps > kFewSteps && !is_fine && !slab.is_uniform) {
          --level;
          continue;
        }
        if (!march_slab(t, end, steps)) return;
        if (steps > 1) {
          t = end;
          continue;
        }
      }
      level = std::min(level + 1, kMostLevel);
      t = end > t ? end : inside.t1;  // slabs so short that t does not move: far away, in tiny voxels
    }
  }

  Slab look_ahead(double t0, double t1) {
    Slab slab;
    for (size_t g = 0; g < m_beams.size(); ++g) {
      const MarchGrid& grid = m_scene.grids[g];
      ValueRange range = m_beams[g].range(t0, t1);
      if (!m_scene.is_leaping) range = m_beams[g].whole();
      if (range.hi == 0.0f) continue;
      slab.is_empty = false;
      slab.is_uniform &= range.is_uniform();
      slab.sigma += grid.extinction * double(range.hi);
      slab.variation += light_scale(grid) * double(range.hi - range.lo);
      slab.voxel = std::min(slab.voxel, m_beams[g].voxel());
    }
    if constexpr (kGrids != 1) {
      const auto scale = [&](const MarchMedium& medium) { return light_scale(medium); };
      m_places.look_ahead(t0, t1, scale, slab);
      m_hazes.look_ahead(m_scene, t0, t1, scale, slab);
    }
    return slab;
  }

  /// How much a density adds to a ray, relative to the brightest it can get [1/m]: by its extinction, or by
  /// what it glows.
  double light_scale(const MarchMedium& medium) const {
    if (!(medium.glow > medium.extinction * m_brightest)) return medium.extinction;
    return medium.glow / std::max(m_brightest, 1e-30);
  }

  int steps_for(const Slab& slab, double span) const {
    return slab.steps(span, double(most_passed()) / m_quality);
  }

  float most_passed() const { return *std::max_element(m_passed.of, m_passed.of + kPacketRays); }

  /// False once all rays have ended.
  bool march_slab(double t0, double t1, int steps) {
    const double dt = (t1 - t0) / steps;
    m_is_inside = true;
    m_is_cut = t0 < m_latest_start || t1 > m_earliest_end;
    if constexpr (kGrids != 1) m_places.find_shadows(t0, t1);
    for (int done = 0; done < steps; done += kMostSteps) {
      const int count = std::min(steps - done, kMostSteps);
      const float first = float(t0 + done * dt - m_base);
      for (size_t v = 0; v < kVectors; ++v) march_vector(v, first, float(dt), count);
      m_samples += uint64_t(count);
      bool has_ended = true;
      for (size_t v = 0; v < kVectors; ++v)
        has_ended &= hn::AllTrue(D(), hn::Le(m_passed.get(v), m_stop.get(v)));
      if (has_ended) return false;
    }
    return true;
  }

  /// Behind the last sample of a medium comes none of its density.
  void leave_medium() {
    const V zero = hn::Zero(D());
    for (size_t v = 0; v < kVectors; ++v)
      m_error2.add(v, m_history.get(v).error2(zero, zero, m_behind.get(v)));
    m_history.reset();
    m_is_inside = false;
  }

  /// Equal steps of the rays of one vector.
  HWY_INLINE void march_vector(size_t v, float first, float step, int count) {
    const D d;
    History history = m_history.get(v);
    V before = m_passed.get(v), tau_sum = hn::Zero(d), error2 = m_error2.get(v);
    const V behind = m_behind.get(v);
    V dt = hn::Set(d, step);
    for (int k = 0; k < count; ++k) {
      V t = hn::Set(d, first + (float(k) + 0.5f) * step);
      if (m_is_cut) cut(v, hn::Set(d, first + float(k) * step), hn::Set(d, step), t, dt);
      const Sample sample = composite(v, t, dt, before, tau_sum);
      if constexpr (kGrids != 1) {
        if (m_shades.any()) {
          const V tau = hn::Mul(sample.sigma, dt), weight = hn::Mul(before, dt);
          error2 = hn::Add(error2, m_shades.error2(v, weight, tau, sample.lit, history.lit1));
        }
      }
      error2 = hn::Add(error2, history.error2(sample.lit, sample.sigma, behind));
      history.push(sample, hn::Mul(before, dt));
      before = sample.after;
    }
    m_history.set(v, history);
    m_error2.set(v, error2);
    m_tau.add(v, tau_sum);
    // A product of few factors is good to a few ulp; over the ray it would drift.
    m_passed.set(v, simd_transmittance(d, m_tau.get(v)));
  }

  /// The part of a step that lies in each ray's own segment.
  HWY_INLINE void cut(size_t v, V begin, V step, V& t, V& dt) const {
    const D d;
    const V from = hn::Max(begin, m_start.get(v)), to = hn::Min(hn::Add(begin, step), m_end.get(v));
    dt = hn::Max(hn::Sub(to, from), hn::Zero(d));
    t = hn::MulAdd(dt, hn::Set(d, 0.5f), from);
  }

  /// Adds a step of every ray to the sums.
  HWY_INLINE Sample composite(size_t v, V t, V dt, V before, V& tau_sum) {
    const D d;
    if constexpr (kGrids == 1) {
      const V rho = density(0, v, t), sigma = hn::Mul(rho, hn::Set(d, m_extinctions[0]));
      const V tau = hn::Mul(sigma, dt), scattered = hn::Mul(before, simd_opacity(d, tau));
      tau_sum = hn::Add(tau_sum, tau);
      const V bright = add_scattered(0, v, scattered, t);
      const V lit = hn::MulAdd(rho, hn::Set(d, float(m_scene.grids[0].glow)), hn::Mul(sigma, bright));
      const V after = hn::Sub(before, scattered);
      if (m_scene.wants_depth) m_depths.note(v, t, dt, rho, tau, before, after);
      return {sigma, lit, bright, after};
    } else {
      return composite_several(v, t, dt, before, tau_sum);
    }
  }

  /// Where media overlap their extinctions add up, and each scatters its share.
  Sample composite_several(size_t v, V t, V dt, V before, V& tau_sum) {
    const D d;
    V sigma = hn::Zero(d), rho_sum = hn::Zero(d);
    if (m_shades.any()) m_shades.look(v, t, dt);
    for (int l = 0; l < lights(); ++l) m_sun_depths[size_t(l)].set(v, sun_depth(l, v, t));
    for (int g = 0; g < media(); ++g) {
      const V rho = g < grids() ? density(g, v, t) : m_hazes.density(size_t(g - grids()), v, t, dt);
      m_rhos[size_t(g)].set(v, rho);
      sigma = hn::MulAdd(rho, hn::Set(d, m_extinctions[size_t(g)]), sigma);
      rho_sum = hn::Add(rho_sum, rho);
    }
    const V tau = hn::Mul(sigma, dt), opacity = simd_opacity(d, tau);
    tau_sum = hn::Add(tau_sum, tau);
    // Mean transmittance over a step: before * (1 - exp(-tau)) / tau.
    const V thin = hn::Set(d, 1e-12f);
    const V share = hn::IfThenElse(hn::Gt(tau, thin), hn::Div(opacity, hn::Max(tau, thin)), hn::Set(d, 1.0f));
    V mean = hn::Mul(hn::Mul(before, share), dt);
    if (m_fog.any()) {
      m_fog.look(v, t);
      m_fog.add(v, hn::Mul(before, opacity));
      mean = hn::Mul(mean, m_fog.passed(v));
    }
    V lit = hn::Zero(d), glow = hn::Zero(d);
    for (int g = 0; g < media(); ++g) {
      const V rho = m_rhos[size_t(g)].get(v), column = hn::Mul(mean, rho);
      sum_of(g, 0).add(v, column);
      const V extinction = hn::Set(d, m_extinctions[size_t(g)]);
      lit = hn::MulAdd(hn::Mul(rho, extinction), add_scattered(g, v, hn::Mul(column, extinction), t), lit);
      glow = hn::MulAdd(rho, hn::Set(d, float(m_scene.medium(size_t(g)).glow)), glow);
    }
    if (m_fog.any()) {
      lit = hn::MulAdd(lit, m_fog.passed(v), hn::Mul(sigma, m_fog.brightest(v)));
      glow = hn::Mul(glow, m_fog.passed(v));
    }
    const V bright = hn::Div(lit, hn::Max(sigma, hn::Set(d, 1e-30f)));
    const V after = hn::NegMulAdd(before, opacity, before);
    if (m_scene.wants_depth) m_depths.note(v, t, dt, rho_sum, tau, before, after);
    return {sigma, hn::Add(lit, glow), bright, after};
  }

  HWY_INLINE V density(int grid, size_t v, V t) const {
    if constexpr (kGrids != 1) {
      if (m_places.any()) return m_places.density(size_t(grid), v, t);
    }
    const PacketPath& path = m_paths[size_t(grid)];
    return m_grids[size_t(grid)].template read<kClamp>(path.at(0, v, t), path.at(1, v, t), path.at(2, v, t));
  }

  /// Adds what a medium scatters of each light and of the height-dependent sky; returns its response to all
  /// lights, as if no solid shaded it: steps are to be as fine in the shade.
  HWY_INLINE V add_scattered(int medium, size_t v, V scattered, V t) {
    V sum = hn::Zero(D());
    for (int l = 0; l < lights(); ++l) {
      const V depth = kGrids == 1 ? sun_depth(l, v, t) : m_sun_depths[size_t(l)].get(v);
      const V response = response_of(medium, l, v, depth);
      V arriving = hn::Mul(scattered, response);
      if constexpr (kGrids != 1) {
        if (m_shades.any()) arriving = hn::Mul(arriving, m_shades.share(l, v));
      }
      sum_of(medium, 2 + l).add(v, arriving);
      sum = hn::Add(sum, response);
    }
    if constexpr (!kPlain) {
      const V height = hn::MulAdd(t, m_height1.get(v), m_height0.get(v));
      sum_of(medium, 1).add(v, hn::Mul(scattered, height));
    }
    return sum;
  }

  PacketFloats& sum_of(int medium, int index) {
    return m_sums[size_t(medium) * sums_per_medium(m_scene) + size_t(index)];
  }

  HWY_INLINE V sun_depth(int light, size_t v, V t) {
    const size_t first = size_t(light) * size_t(grids());
    if constexpr (kGrids == 1) return lattice_depth(first, v, t);
    V sum = m_hazes.any() ? m_hazes.depth(light, v, t) : hn::Zero(D());
    if (m_places.any()) return hn::Add(sum, m_places.depth(light, v, t, m_lookups));
    if (m_scene.shadow_step > 0.0) return hn::Add(sum, traced_depth(light, v, t));
    for (int g = 0; g < grids(); ++g) sum = hn::Add(sum, lattice_depth(first + size_t(g), v, t));
    return sum;
  }

  HWY_INLINE V lattice_depth(size_t index, size_t v, V t) const {
    const PacketPath& path = m_sun_paths[index];
    return m_lattices[index].read(path.at(0, v, t), path.at(1, v, t), path.at(2, v, t));
  }

  /// Shadow rays of all lanes in step, through every grid.
  V traced_depth(int light, size_t v, V t) {
    V sum = hn::Zero(D());
    for (int g = 0; g < grids(); ++g) {
      if (m_extinctions[size_t(g)] > 0.0f) sum = hn::Add(sum, traced_depth(light, g, v, t));
    }
    return sum;
  }

  V traced_depth(int light, int grid, size_t v, V t) {
    const MarchGrid& scene = m_scene.grids[size_t(grid)];
    const Vec3d towards = scene.local_from_world.direction(m_scene.towards_suns[size_t(light)]);
    const PacketPath& path = m_paths[size_t(grid)];
    return trace_shadow(scene, m_grids[size_t(grid)], {towards, m_scene.shadow_step, m_scene.enough_shadow},
                        path.at(0, v, t), path.at(1, v, t), path.at(2, v, t), m_lookups);
  }

  HWY_INLINE V response_of(int medium, int light, size_t v, V tau) const {
    const D d;
    const PacketFloats* weights =
        m_weights.data() + (size_t(medium) * size_t(lights()) + size_t(light)) * kTermsKept;
    if constexpr (kPlain) {
      return hn::Mul(weights[0].get(v), simd_transmittance(d, tau));
    } else {
      const MarchMedium& terms = m_scene.medium(size_t(medium));
      V sum = hn::Zero(d);
      for (int k = 0; k < terms.terms; ++k) {
        const V extinction = hn::Set(d, terms.term_extinction[size_t(k)]);
        sum = hn::MulAdd(weights[k].get(v), simd_transmittance(d, hn::Mul(extinction, tau)), sum);
      }
      return sum;
    }
  }

  void finish(std::span<MarchResult> results, double* sums) {
    if (m_is_inside) leave_medium();
    for (size_t i = 0; i < results.size(); ++i) {
      MarchResult& result = results[i];
      result = {};
      result.tau = m_tau.of(i);
      result.error = std::sqrt(double(m_error2.of[i])) / 24.0;
      result.first = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
      result.z_half = result.first.t1;
      if (m_scene.wants_depth) m_depths.tell(i, m_base, result);
      result.samples = m_samples;
      result.lookups = m_scene.shadow_step > 0.0 ? m_lookups / kPacketRays : m_samples * uint64_t(lights());
      result.leaps = m_leaps;
      double* const own = sums + i * m_sums.size();
      for (size_t n = 0; n < m_sums.size(); ++n) own[n] = double(m_sums[n].of[i]);
      if constexpr (kGrids != 1) {
        if (m_fog.any()) m_fog.tell(i, *m_rays[i].fog);
      }
      // A grid alone scatters all that does not pass.
      if constexpr (kGrids == 1) own[0] = opacity_from_tau(result.tau) / m_scene.grids[0].extinction;
    }
  }

  const MarchScene& m_scene;
  Shades m_shades;
  PacketFog m_fog;
  Hazes m_hazes;
  std::vector<GridReader> m_grids;
  std::vector<LatticeReader> m_lattices;
  Places m_places;                   ///< where some grid stands in several
  std::vector<float> m_extinctions;  ///< of each medium [1/m]

  // The present packet. t of the floats counts from m_base.
  std::span<const MarchRay> m_rays;
  std::vector<Ray> m_locals;      ///< [grid][ray]; this and what follows where each grid stands but once
  std::vector<GridBeam> m_beams;  ///< one per grid
  std::vector<PacketPath> m_paths, m_sun_paths;
  std::vector<PacketFloats> m_weights;     ///< [medium][light][term]
  std::vector<PacketFloats> m_sums;        ///< [medium][sum]
  std::vector<PacketFloats> m_rhos;        ///< [medium]: densities of the present samples
  std::vector<PacketFloats> m_sun_depths;  ///< [light]: optical depths towards suns there
  double m_base = 0.0, m_finest = 0.0, m_latest_start = 0.0, m_earliest_end = 0.0;
  double m_quality = 0.0, m_brightest = 0.0;
  bool m_is_inside = false;  ///< the last slab was not empty
  bool m_is_cut = false;     ///< some ray begins or ends in the present slab
  uint64_t m_samples = 0, m_lookups = 0, m_leaps = 0;
  PacketFloats m_start, m_end, m_behind, m_stop, m_height0, m_height1, m_passed, m_error2;
  CompensatedFloats m_tau;
  PacketHistory m_history;
  PacketDepths m_depths;
};

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
