// Analytic media, hazes, on the rays of a packet.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_HAZES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_HAZES_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_HAZES_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_HAZES_INL_H
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "hwy/highway.h"

#include "integrators/kernels/packet-inl.h"
#include "integrators/kernels/walks-inl.h"
#include "lib/math/transmittance.h"
#include "lib/simd/exponential-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Every ray brings the stretch on which it is in each haze, where the density is an exponential of t, and a
/// table of their optical depth towards each sun.
class Hazes {
 public:
  Hazes(size_t hazes, int lights) : m_stretches(hazes), m_tables(size_t(lights)) {}

  bool any() const { return !m_stretches.empty(); }

  /// The shortest mean free path in the hazes on the rays [m].
  double mean_free_path(const MarchScene& scene, std::span<const MarchRay> rays) const {
    double sigma = 0.0;
    for (const MarchRay& ray : rays) {
      for (size_t h = 0; h < m_stretches.size(); ++h)
        sigma = std::max(sigma, scene.hazes[h].extinction * ray.hazes[h].densest);
    }
    return 1.0 / sigma;
  }

  /// Where on the rays some haze is.
  Segment inside(std::span<const MarchRay> rays) const {
    Segment hull{std::numeric_limits<double>::infinity(), 0.0};
    for (const MarchRay& ray : rays) {
      for (size_t h = 0; h < m_stretches.size(); ++h) {
        const Segment& own = ray.hazes[h].inside;
        if (!own.empty()) hull = {std::min(hull.t0, own.t0), std::max(hull.t1, own.t1)};
      }
    }
    return hull;
  }

  /// t of the steps counts from `base`; lanes beyond the rays repeat the last.
  void begin(std::span<const MarchRay> rays, double base) {
    m_base = base;
    m_grid_shadows = hull_of_grid_shadows(rays);
    for (size_t i = 0; i < kPacketRays && any(); ++i) {
      const MarchRay& ray = rays[std::min(i, rays.size() - 1)];
      for (size_t h = 0; h < m_stretches.size(); ++h) m_stretches[h].set(i, ray.hazes[h], base);
      for (size_t l = 0; l < m_tables.size(); ++l) m_tables[l][i] = ray.haze_depths[l];
    }
    for (Stretches& stretch : m_stretches) stretch.find_steepest();
  }

  /// Adds what is between t0 and t1. The light in a haze varies as the shadows of grids and hazes do where
  /// they lie in it. It begins and ends all at once, so that samples on both sides of a step tell little of
  /// its error.
  ///   light_scale: of a haze, Outlook::light_scale
  template <class LightScale>
  void look_ahead(const MarchScene& scene, double t0, double t1, const LightScale& light_scale,
                  Slab& slab) const {
    constexpr double kSharp = 4.0;
    const bool may_be_shaded = t1 > m_grid_shadows.t0 && t0 < m_grid_shadows.t1;
    const double shadow_slope =
        (may_be_shaded ? 1.0 / scene.shadow_width : 0.0) + kSharp * change_of_light(t0, t1);
    for (size_t h = 0; h < m_stretches.size(); ++h) {
      const double densest_here = double(densest(h, t0, t1));
      if (densest_here == 0.0) continue;
      const double sigma = scene.hazes[h].extinction * densest_here;
      slab.is_empty = slab.is_uniform = false;
      slab.sigma += sigma;
      slab.slope +=
          light_scale(scene.hazes[h]) * densest_here * (steepest(h) + shadow_slope + kSharp * sigma);
    }
  }

  /// Upper bound of a haze's density between t0 and t1: that of an exponential is at an end.
  float densest(size_t haze, double t0, double t1) const {
    const D d;
    const Stretches& of = m_stretches[haze];
    V most = hn::Zero(d);
    for (size_t v = 0; v < kVectors; ++v) {
      const V begin = of.begin.get(v), end = of.end.get(v);
      const V from = hn::Max(hn::Set(d, float(t0 - m_base)), begin),
              to = hn::Min(hn::Set(d, float(t1 - m_base)), end);
      const V density = hn::Max(of.density_at(v, from), of.density_at(v, to));
      most = hn::Max(most, hn::IfThenElseZero(hn::Gt(to, from), density));
    }
    return hn::GetLane(hn::MaxOfLanes(d, most));
  }

  /// The steepest relative slope of a haze's density on any of the rays [1/m].
  double steepest(size_t haze) const { return m_stretches[haze].steepest; }

  /// Mean density of a haze over a step, by the midpoint rule in the part of it that has some. What a step
  /// lacks is told from its middle: the difference of its ends would be rounded as these are, and short steps
  /// lose a part of their density.
  HWY_INLINE V density(size_t haze, size_t v, V t, V dt) const {
    const D d;
    const Stretches& of = m_stretches[haze];
    const V half = hn::Mul(dt, hn::Set(d, 0.5f)), zero = hn::Zero(d);
    const V before = hn::Max(hn::Add(hn::Sub(of.begin.get(v), t), half), zero),
            after = hn::Max(hn::Add(hn::Sub(t, of.end.get(v)), half), zero);
    const V covered = hn::Max(hn::Sub(hn::Sub(dt, before), after), zero);
    const V middle = hn::MulAdd(hn::Sub(before, after), hn::Set(d, 0.5f), t);
    const V share = hn::Div(covered, hn::Max(dt, hn::Set(d, 1e-30f)));
    return hn::Mul(of.density_at(v, middle), share);
  }

  /// Optical depth of all hazes towards a sun. Steps come in order.
  HWY_INLINE V depth(int light, size_t v, V t) {
    alignas(64) float ts[kLanes], depths[kLanes];
    hn::Store(t, D(), ts);
    for (size_t i = 0; i < kLanes; ++i)
      depths[i] = read(m_tables[size_t(light)][v * kLanes + i], m_base + double(ts[i]));
    return hn::Load(D(), depths);
  }

 private:
  struct Stretches {
    PacketFloats begin, end, densest, densest_at, slope;  ///< densities fall from their largest
    double steepest = 0.0;

    void set(size_t lane, const HazeStretch& stretch, double base) {
      begin.of[lane] = float(stretch.inside.t0 - base);
      end.of[lane] = float(stretch.inside.t1 - base);
      densest.of[lane] = float(stretch.densest);
      densest_at.of[lane] = stretch.rate > 0.0 ? end.of[lane] : begin.of[lane];
      slope.of[lane] = float(std::abs(stretch.rate));
    }
    void find_steepest() { steepest = double(*std::max_element(slope.of, slope.of + kPacketRays)); }
    HWY_INLINE V density_at(size_t v, V t) const {
      const V fall = hn::Mul(slope.get(v), hn::Abs(hn::Sub(t, densest_at.get(v))));
      return hn::Mul(densest.get(v), simd_transmittance(D(), fall));
    }
  };

  /// By how much the share of any sun's light that hazes leave changes on a ray between t0 and t1, to and
  /// fro, per length [1/m]: edges of shadows are steep, but few. Every fifth ray tells, as neighbours see
  /// much the same.
  double change_of_light(double t0, double t1) const {
    double most = 0.0;
    for (const auto& rays : m_tables) {
      for (size_t ray = 0; ray < kPacketRays; ++ray)
        most = std::max(most, change_of_light(rays[ray], t0, t1));
    }
    return most / (t1 - t0);
  }

  static double change_of_light(std::span<const HazeDepth> nodes, double t0, double t1) {
    double change = 0.0;
    for (size_t i = 1; i < nodes.size() && nodes[i - 1].t < t1; ++i) {
      const double inside = std::min(nodes[i].t, t1) - std::max(nodes[i - 1].t, t0);
      if (!(inside > 0.0) || nodes[i].depth == nodes[i - 1].depth) continue;
      const double all = std::abs(transmittance(nodes[i].depth) - transmittance(nodes[i - 1].depth));
      change += all * inside / (nodes[i].t - nodes[i - 1].t);
    }
    return change;
  }

  static Segment hull_of_grid_shadows(std::span<const MarchRay> rays) {
    Segment hull{std::numeric_limits<double>::infinity(), 0.0};
    for (const MarchRay& ray : rays) {
      if (!ray.grid_shadows.empty())
        hull = {std::min(hull.t0, ray.grid_shadows.t0), std::max(hull.t1, ray.grid_shadows.t1)};
    }
    return hull;
  }

  static float read(std::span<const HazeDepth>& left, double t) {
    while (left.size() > 2 && left[1].t < t) left = left.subspan(1);
    if (left.size() < 2) return left.empty() ? 0.0f : float(left[0].depth);
    const double share = std::clamp((t - left[0].t) / (left[1].t - left[0].t), 0.0, 1.0);
    return float(left[0].depth + share * (left[1].depth - left[0].depth));
  }

  std::vector<Stretches> m_stretches;                                         ///< [haze]
  std::vector<std::array<std::span<const HazeDepth>, kPacketRays>> m_tables;  ///< [light]
  double m_base = 0.0;
  Segment m_grid_shadows;  ///< of the packet: grids may shade hazes nowhere else
};

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
