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
#include "integrators/kernels/lamps-inl.h"
#include "integrators/kernels/lattice_reader-inl.h"
#include "integrators/kernels/outlook-inl.h"
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
        m_places(scene, m_grids, m_lattices),
        m_lamps(scene, m_grids),
        m_outlook(scene, m_places, m_hazes, m_lamps) {
    for (size_t i = 0; i < scene.media(); ++i) m_extinctions.push_back(float(scene.medium(i).extinction));
    if (!m_places.any()) {
      m_paths.resize(m_grids.size());
      m_sun_paths.resize(m_lattices.size());
    }
    m_weights.resize(scene.media() * size_t(lights()) * (kPlain ? 1 : kMostTerms));
    m_sums.resize(scene.media() * sums_per_medium(scene));
    m_rhos.resize(scene.media());
    m_sun_depths.resize(size_t(lights()));
  }

  /// rays: at most kPacketRays; sums: [ray][medium][sum]
  void march(std::span<const MarchRay> rays, std::span<MarchResult> results, double* sums) {
    m_rays = rays;
    m_samples = m_lookups = 0;
    const Segment inside = m_outlook.leap_ahead(m_outlook.enter(rays));
    if (inside.empty()) return miss(results, sums);
    begin(inside);
    walk(inside);
    finish(results, sums);
  }

 private:
  static constexpr bool kClamp = true;  ///< the rays beside one in the grid may be outside
  static constexpr size_t kTogether = std::min<size_t>(kVectors, 2);  ///< vectors of rays
  static constexpr size_t kTermsKept = kPlain ? 1 : kMostTerms;
  static constexpr int kFewSteps = 2;    ///< a slab that needs no more is not worth dividing
  static constexpr int kMostSteps = 32;  ///< between two looks at what is left of the rays

  int grids() const { return kGrids > 0 ? kGrids : int(m_grids.size()); }
  int media() const { return kGrids > 0 ? kGrids : int(m_scene.media()); }
  int lights() const { return kLights >= 0 ? kLights : m_scene.lights; }

  /// The answer for rays that meet nothing.
  void miss(std::span<MarchResult> results, double* sums) const {
    MarchResult nothing;
    nothing.z_half = std::numeric_limits<double>::infinity();
    nothing.first = {nothing.z_half, nothing.z_half};
    nothing.leaps = m_outlook.leaps;
    std::fill(results.begin(), results.end(), nothing);
    std::fill_n(sums, m_rays.size() * m_sums.size(), 0.0);
  }

  /// Kernel positions are counted from the entry of the first medium: floats then suffice.
  void begin(const Segment& inside) {
    m_base = inside.t0;
    m_quality = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < kPacketRays; ++i) {
      // A packet that is not full has its last ray several times.
      const size_t ray = std::min(i, m_rays.size() - 1);
      const MarchRay& job = m_rays[ray];
      place(i, ray, job.ray);
      m_segments.set(i, job.segment, m_base);
      m_behind.of[i] = float(job.behind);
      m_stop.of[i] = float(job.stop);
      m_quality = std::min(m_quality, job.step_quality);
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
      m_lamps.begin(m_rays, m_base);
    }
  }

  void place(size_t lane, size_t ray, const Ray& world) {
    for (size_t g = 0; g < m_paths.size(); ++g) {
      const Ray& local = m_outlook.local(g, ray);
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
      const double end = m_outlook.slab_end(t, level, inside.t1);
      const Slab slab = m_outlook.look(t, end);
      if (slab.is_empty) {
        ++m_outlook.leaps;
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
      level = std::min(level + 1, Outlook<kGrids>::kMostLevel);
      t = end > t ? end : inside.t1;  // slabs so short that t does not move: far away, in tiny voxels
    }
  }

  int steps_for(const Slab& slab, double span) const {
    const double brightness = kGrids == 1 ? 1.0 : slab.brightness;
    return slab.steps(span, brightness * double(most_passed()) / m_quality);
  }

  float most_passed() const { return *std::max_element(m_passed.of, m_passed.of + kPacketRays); }

  /// False once all rays have ended.
  bool march_slab(double t0, double t1, int steps) {
    const double dt = (t1 - t0) / steps;
    m_is_inside = true;
    m_is_cut = t0 < m_outlook.latest_start || t1 > m_outlook.earliest_end;
    if constexpr (kGrids != 1) m_places.find_shadows(t0, t1);
    for (int done = 0; done < steps; done += kMostSteps) {
      const int count = std::min(steps - done, kMostSteps);
      const float first = float(t0 + done * dt - m_base);
      for (size_t v = 0; v < kVectors; v += kTogether) march_vectors(v, first, float(dt), count);
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

  /// A vector of rays between two steps.
  struct Way {
    History history;
    V before, tau, error2;
    V t, dt;  ///< of the present step: its middle and its length
  };

  /// Equal steps of the rays of kTogether vectors. Each step is a long chain in which everything waits for
  /// what is before it: two chains side by side take little longer than one.
  HWY_INLINE void march_vectors(size_t v0, float first, float step, int count) {
    Way ways[kTogether];
    for (size_t u = 0; u < kTogether; ++u) ways[u] = begin_way(v0 + u);
    GridReader::Cells cells[2][kTogether];  ///< of even and of odd steps
    if constexpr (kGrids == 1) look_ahead(v0, first, step, 0, cells[0]);
    for (int k = 0; k < count; ++k) {
      if constexpr (kGrids == 1) look_ahead(v0, first, step, k + 1, cells[(k + 1) & 1]);
      for (size_t u = 0; u < kTogether; ++u) place_step(v0 + u, first, step, k, ways[u].t, ways[u].dt);
      Sample samples[kTogether];
      composite(v0, ways, cells[k & 1], samples);
      for (size_t u = 0; u < kTogether; ++u) advance(v0 + u, samples[u], ways[u]);
    }
    for (size_t u = 0; u < kTogether; ++u) {
      const size_t v = v0 + u;
      m_history.set(v, ways[u].history);
      m_error2.set(v, ways[u].error2);
      m_tau.add(v, ways[u].tau);
      // A product of few factors is good to a few ulp; over the ray it would drift.
      m_passed.set(v, simd_transmittance(D(), m_tau.get(v)));
    }
  }

  HWY_INLINE Way begin_way(size_t v) const {
    const V zero = hn::Zero(D());
    return {m_history.get(v), m_passed.get(v), zero, m_error2.get(v), zero, zero};
  }

  HWY_INLINE void place_step(size_t v, float first, float step, int k, V& t, V& dt) const {
    const D d;
    t = hn::Set(d, first + (float(k) + 0.5f) * step);
    dt = hn::Set(d, step);
    if (m_is_cut) m_segments.cut(v, hn::Set(d, first + float(k) * step), hn::Set(d, step), t, dt);
  }

  /// Finds out where a step will read, and asks memory for it while the step before is composited.
  HWY_INLINE void look_ahead(size_t v0, float first, float step, int k, GridReader::Cells* cells) const {
    for (size_t u = 0; u < kTogether; ++u) {
      V t, dt;
      place_step(v0 + u, first, step, k, t, dt);
      cells[u] = locate(0, v0 + u, t);
      m_grids[0].prefetch(cells[u]);
    }
  }

  HWY_INLINE void advance(size_t v, const Sample& sample, Way& way) {
    const V weight = hn::Mul(way.before, way.dt);
    if constexpr (kGrids != 1) {
      if (m_shades.any()) {
        const V tau = hn::Mul(sample.sigma, way.dt);
        way.error2 = hn::Add(way.error2, m_shades.error2(v, weight, tau, sample.lit, way.history.lit1));
      }
    }
    way.error2 = hn::Add(way.error2, way.history.error2(sample.lit, sample.sigma, m_behind.get(v)));
    way.history.push(sample, weight);
    way.before = sample.after;
  }

  /// Adds a step of every ray to the sums.
  HWY_INLINE void composite(size_t v0, Way* ways, const GridReader::Cells* cells, Sample* samples) {
    if constexpr (kGrids == 1) {
      LatticeReader::Cells sun_cells[kTogether];
      if constexpr (kLights == 1) {
        for (size_t u = 0; u < kTogether; ++u) sun_cells[u] = locate_sun(0, v0 + u, ways[u].t);
      }
      V rhos[kTogether], depths[kTogether] = {};
      for (size_t u = 0; u < kTogether; ++u) rhos[u] = m_grids[0].read(cells[u]);
      if constexpr (kLights == 1) {
        for (size_t u = 0; u < kTogether; ++u) depths[u] = m_lattices[0].read(sun_cells[u]);
      }
      for (size_t u = 0; u < kTogether; ++u) samples[u] = composite_one(v0 + u, rhos[u], depths[u], ways[u]);
    } else {
      for (size_t u = 0; u < kTogether; ++u)
        samples[u] = composite_several(v0 + u, ways[u].t, ways[u].dt, ways[u].before, ways[u].tau);
    }
  }

  /// A grid alone.
  ///   depth: of the light, where there is one
  HWY_INLINE Sample composite_one(size_t v, V rho, V depth, Way& way) {
    const D d;
    const V sigma = hn::Mul(rho, hn::Set(d, m_extinctions[0]));
    const V tau = hn::Mul(sigma, way.dt), scattered = hn::Mul(way.before, simd_opacity(d, tau));
    way.tau = hn::Add(way.tau, tau);
    const V bright = add_scattered(0, v, scattered, way.t, depth);
    const V lit = hn::MulAdd(rho, hn::Set(d, float(m_scene.grids[0].glow)), hn::Mul(sigma, bright));
    const V after = hn::Sub(way.before, scattered);
    if (m_scene.wants_depth) m_depths.note(v, way.t, way.dt, rho, tau, way.before, after);
    return {sigma, lit, bright, after};
  }

  /// Where media overlap their extinctions add up, and each scatters its share.
  Sample composite_several(size_t v, V t, V dt, V before, V& tau_sum) {
    const D d;
    V sigma = hn::Zero(d), rho_sum = hn::Zero(d);
    if (m_shades.any()) m_shades.look(v, t, dt);
    m_lamps.look(v, t);
    for (int l = 0; l < lights(); ++l) m_sun_depths[size_t(l)].set(v, sun_depth(l, v, t));
    for (int g = 0; g < media(); ++g) {
      const V rho = g < grids() ? density(size_t(g), v, t) : m_hazes.density(size_t(g - grids()), v, t, dt);
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
      lit = hn::MulAdd(hn::Mul(rho, extinction),
                       add_scattered(g, v, hn::Mul(column, extinction), t, hn::Zero(d)), lit);
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

  HWY_INLINE V density(size_t grid, size_t v, V t) const {
    if (m_places.any()) return m_places.density(grid, v, t);
    return m_grids[grid].read(locate(grid, v, t));
  }

  HWY_INLINE GridReader::Cells locate(size_t grid, size_t v, V t) const {
    const PacketPath& path = m_paths[grid];
    return m_grids[grid].template locate<kClamp>(path.at(0, v, t), path.at(1, v, t), path.at(2, v, t));
  }

  HWY_INLINE LatticeReader::Cells locate_sun(size_t lattice, size_t v, V t) const {
    const PacketPath& path = m_sun_paths[lattice];
    return m_lattices[lattice].locate(path.at(0, v, t), path.at(1, v, t), path.at(2, v, t));
  }

  /// Adds what a medium scatters of each light and of the height-dependent sky; returns its response to all
  /// lights, as if no solid shaded it: steps are to be as fine in the shade.
  ///   depth: towards the light of a grid that has one alone
  HWY_INLINE V add_scattered(int medium, size_t v, V scattered, V t, V depth) {
    V sum = hn::Zero(D());
    for (int l = 0; l < lights(); ++l) {
      if constexpr (kGrids != 1)
        depth = m_sun_depths[size_t(l)].get(v);
      else if constexpr (kLights != 1)
        depth = lattice_depth(size_t(l), v, t);
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
    if (m_lamps.is_lamp(light)) return m_lamps.depth(light, v, t, m_paths, m_lookups);
    const size_t first = size_t(light) * size_t(grids());
    V sum = m_hazes.any() ? m_hazes.depth(light, v, t) : hn::Zero(D());
    if (m_places.any()) return hn::Add(sum, m_places.depth(light, v, t, m_lookups));
    if (m_scene.shadow_step > 0.0) return hn::Add(sum, traced_depth(light, v, t));
    for (int g = 0; g < grids(); ++g) sum = hn::Add(sum, lattice_depth(first + size_t(g), v, t));
    return sum;
  }

  HWY_INLINE V lattice_depth(size_t index, size_t v, V t) const {
    return m_lattices[index].read(locate_sun(index, v, t));
  }

  /// Shadow rays of all lanes in step, through every grid.
  V traced_depth(int light, size_t v, V t) {
    V sum = hn::Zero(D());
    for (size_t g = 0; g < m_grids.size(); ++g) {
      const MarchGrid& grid = m_scene.grids[g];
      if (!(grid.extinction > 0.0)) continue;
      const Vec3d towards = grid.local_from_world.direction(m_scene.towards_suns[size_t(light)]);
      const PacketPath& path = m_paths[g];
      sum = hn::Add(sum, trace_shadow(grid, m_grids[g], {towards, m_scene.shadow_step, m_scene.enough_shadow},
                                      path.at(0, v, t), path.at(1, v, t), path.at(2, v, t), m_lookups));
    }
    return sum;
  }

  HWY_INLINE V response_of(int medium, int light, size_t v, V tau) const {
    const D d;
    if (kGrids != 1 && m_lamps.is_lamp(light)) return m_lamps.response(medium, light, v, tau);
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
      result.leaps = m_outlook.leaps;
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
  Places m_places;  ///< where some grid stands in several
  Lamps m_lamps;
  Outlook<kGrids> m_outlook;
  std::vector<float> m_extinctions;  ///< of each medium [1/m]

  // The present packet. t of the floats counts from m_base.
  std::span<const MarchRay> m_rays;
  std::vector<PacketPath> m_paths, m_sun_paths;  ///< where each grid stands but once
  std::vector<PacketFloats> m_weights;           ///< [medium][light][term]
  std::vector<PacketFloats> m_sums;              ///< [medium][sum]
  std::vector<PacketFloats> m_rhos;              ///< [medium]: densities of the present samples
  std::vector<PacketFloats> m_sun_depths;        ///< [light]: optical depths towards suns there
  double m_base = 0.0, m_quality = 0.0;
  bool m_is_inside = false;  ///< the last slab was not empty
  bool m_is_cut = false;     ///< some ray begins or ends in the present slab
  uint64_t m_samples = 0, m_lookups = 0;
  PacketSegments m_segments;
  PacketFloats m_behind, m_stop, m_height0, m_height1, m_passed, m_error2;
  CompensatedFloats m_tau;
  PacketHistory m_history;
  PacketDepths m_depths;
};

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
