// Lights at a finite distance, on the rays of a packet.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_LAMPS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_LAMPS_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_LAMPS_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_LAMPS_INL_H
#endif

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "hwy/highway.h"

#include "integrators/kernels/lattice_reader-inl.h"
#include "integrators/kernels/packet-inl.h"
#include "integrators/kernels/readers-inl.h"
#include "integrators/kernels/shadow_rays-inl.h"
#include "integrators/kernels/walks-inl.h"
#include "lib/simd/exponential-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// What lamps make of the steps of a packet. Along a ray, a lamp is known by where the ray comes closest to
/// it and how close: the distance r, the irradiance 1 / r^2 and the cosine of the scattering angle follow,
/// and the phase function comes from a table.
class Lamps {
 public:
  /// Both outlive it.
  Lamps(const MarchScene& scene, std::span<const GridReader> grids)
      : m_scene(scene), m_grids(grids), m_lamp_of(scene.lamps.empty() ? 0 : size_t(scene.lights), -1) {
    for (size_t n = 0; n < scene.lamps.size(); ++n) {
      m_lamp_of[size_t(scene.lamps[n].light)] = int(n);
      m_lamps.emplace_back(scene.lamps[n], scene.media());
    }
  }

  bool any() const { return !m_lamps.empty(); }

  bool is_lamp(int light) const { return any() && m_lamp_of[size_t(light)] >= 0; }

  /// For looking ahead; t counts from `base`. Lanes beyond the rays repeat the last.
  void enter(std::span<const MarchRay> rays, double base) {
    if (!any()) return;
    m_base = base;
    constexpr double kOpacity = 1.0;  // where lamps are dim, what the media hide counts
    m_brightest = 0.0, m_other_light = kOpacity;
    for (const MarchRay& ray : rays) {
      m_brightest = std::max(m_brightest, ray.brightest);
      m_other_light = std::max({m_other_light, ray.behind, ray.brightest - ray.lamplight});
    }
    for (Lamp& lamp : m_lamps) {
      for (size_t i = 0; i < kPacketRays; ++i) lamp.enter(i, rays[std::min(i, rays.size() - 1)].ray, base);
    }
  }

  /// For the steps of a march, too.
  void begin(std::span<const MarchRay> rays, double base) {
    if (!any()) return;
    enter(rays, base);
    for (Lamp& lamp : m_lamps) {
      for (size_t i = 0; i < kPacketRays; ++i) lamp.place(i, rays[std::min(i, rays.size() - 1)].ray, base);
    }
  }

  /// How far a slab that begins at t may reach: to half way to the nearest lamp, whose light is then of one
  /// order in all of it.
  double reach(double t) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Lamp& lamp : m_lamps) nearest = std::min(nearest, lamp.nearest(t - m_base, t - m_base));
    return 0.5 * nearest;
  }

  /// Adds what the light of lamps asks of the steps between t0 and t1: by how bright it is there, at most,
  /// and by how it varies.
  void look_ahead(double t0, double t1, Slab& slab) const {
    if (!any() || slab.is_empty) return;
    // What a second derivative adds up to over a peak, in units of its height by its width, and more: errors
    // of steps are alike on a whole flank of it.
    constexpr double kOfDistance = 8.0, kOfAngle = 6.0, kMostPerDistance = 256.0;
    double light = 0.0, slope = 0.0;
    for (const Lamp& lamp : m_lamps) {
      const double r = lamp.nearest(t0 - m_base, t1 - m_base), s0 = lamp.least_s(t0 - m_base),
                   s1 = lamp.most_s(t1 - m_base);
      double brightest = 0.0, steepest = 0.0;
      for (size_t m = 0; m < m_scene.media(); ++m) {
        const LampPhase& phase = m_scene.lamp_phases[m];
        const PhaseTable::Part part = phase.table.between(s0, s1);
        const double strength = double(lamp.scene->strengths[m]);
        brightest = std::max(brightest, strength * phase.most(part.most));
        steepest = std::max(steepest, strength * (kOfDistance * phase.most(part.most) +
                                                  kOfAngle * phase.shaped_sum * part.steepest));
      }
      slab.most_rate = std::max(slab.most_rate, kMostPerDistance / r);
      light += brightest / (r * r);
      slope += steepest / (r * r * r);
    }
    const double all = std::max(m_other_light + light, 1e-30);
    slab.brightness = std::min(all / std::max(m_brightest, 1e-30), 1.0);
    slab.slope += slab.sigma * slope / all;
  }

  /// Looks at the middle of a step of the rays of one vector.
  void look(size_t v, V t) {
    for (Lamp& lamp : m_lamps) {
      lamp.look(v, t);
      for (size_t m = 0; m < m_scene.media(); ++m)
        lamp.phases[m].set(v, read(m_scene.lamp_phases[m].table, lamp.s.get(v)));
    }
  }

  /// Optical depth of all grids from the step looked at to a lamp.
  ///   paths: of the rays in every grid
  V depth(int light, size_t v, V t, std::span<const PacketPath> paths, uint64_t& lookups) const {
    const Lamp& lamp = of(light);
    V sum = hn::Zero(D());
    for (size_t g = 0; g < m_grids.size(); ++g) {
      const MarchGrid& grid = m_scene.grids[g];
      if (!(grid.extinction > 0.0)) continue;
      if (m_scene.shadow_step > 0.0) {
        const LampRays rays{grid.local_from_world.point(lamp.scene->position), m_scene.shadow_step,
                            m_scene.enough_shadow};
        sum = hn::Add(sum, trace_to_lamp(grid, m_grids[g], rays, paths[g].at(0, v, t), paths[g].at(1, v, t),
                                         paths[g].at(2, v, t), lamp.distance.get(v), lookups));
      } else {
        sum = hn::Add(sum, lamp.depth(g, v, t));
      }
    }
    return sum;
  }

  /// What a medium scatters of a lamp's light there, seen through nothing.
  ///   tau: the depth of the lamp
  HWY_INLINE V response(int medium, int light, size_t v, V tau) const {
    const D d;
    const Lamp& lamp = of(light);
    const LampPhase& phase = m_scene.lamp_phases[size_t(medium)];
    const MarchMedium& terms = m_scene.medium(size_t(medium));
    const V p = lamp.phases[size_t(medium)].get(v);
    V sum = hn::Zero(d);
    for (size_t k = 0; k < size_t(terms.terms); ++k) {
      const V weight = hn::MulAdd(hn::Set(d, phase.shaped[k]), p, hn::Set(d, phase.flat[k]));
      const V passed = simd_transmittance(d, hn::Mul(hn::Set(d, terms.term_extinction[k]), tau));
      sum = hn::MulAdd(weight, passed, sum);
    }
    const V strength = hn::Set(d, lamp.scene->strengths[size_t(medium)]);
    return hn::Mul(sum, hn::Mul(lamp.irradiance.get(v), strength));
  }

 private:
  /// A face of the lamp's lattice of a grid.
  struct Face {
    explicit Face(const LampFace& face) : scene(&face), reader(face.depths) {}

    void place(size_t lane, const Ray& world, double base) {
      const Affine& map = scene->depths.lattice_from_world;
      path.set(lane, map.point(world.at(base)), map.direction(world.d));
    }

    const LampFace* scene;
    LatticeReader reader;
    PacketPath path;  ///< X, Y, W of LampFace
  };

  struct Lamp {
    Lamp(const MarchLamp& lamp, size_t media) : scene(&lamp), faces(lamp.faces.size()), phases(media) {
      for (size_t g = 0; g < faces.size(); ++g)
        for (const LampFace& face : lamp.faces[g]) faces[g].emplace_back(face);
    }

    void enter(size_t lane, const Ray& ray, double base) {
      const Vec3d to_lamp = scene->position - ray.at(base);
      const double along = dot(to_lamp, ray.d);
      const Vec3d aside = to_lamp - along * ray.d;
      closest.of[lane] = float(along);
      aside2.of[lane] = float(dot(aside, aside));
    }

    void place(size_t lane, const Ray& ray, double base) {
      for (std::vector<Face>& of_grid : faces)
        for (Face& face : of_grid) face.place(lane, ray, base);
    }

    /// The least distance from any of the rays between two t, as irradiance counts it.
    double nearest(double t0, double t1) const {
      const D d;
      V least = hn::Set(d, std::numeric_limits<float>::max());
      for (size_t v = 0; v < kVectors; ++v) {
        const V at = closest.get(v);
        const V before = hn::Sub(hn::Set(d, float(t0)), at), after = hn::Sub(at, hn::Set(d, float(t1)));
        const V away = hn::Max(hn::Max(before, after), hn::Zero(d));
        least = hn::Min(least, hn::MulAdd(away, away, aside2.get(v)));
      }
      return std::max(std::sqrt(double(hn::GetLane(hn::MinOfLanes(d, least)))), scene->radius);
    }

    /// The s of PhaseTable grow along a ray.
    double least_s(double t) const {
      V least = s_at(0, hn::Set(D(), float(t)));
      for (size_t v = 1; v < kVectors; ++v) least = hn::Min(least, s_at(v, hn::Set(D(), float(t))));
      return double(hn::GetLane(hn::MinOfLanes(D(), least)));
    }
    double most_s(double t) const {
      V most = s_at(0, hn::Set(D(), float(t)));
      for (size_t v = 1; v < kVectors; ++v) most = hn::Max(most, s_at(v, hn::Set(D(), float(t))));
      return double(hn::GetLane(hn::MaxOfLanes(D(), most)));
    }

    V s_at(size_t v, V t) const {
      const V along = hn::Sub(t, closest.get(v));
      return s_of(along, aside2.get(v), hn::Sqrt(hn::MulAdd(along, along, aside2.get(v))));
    }

    /// sin^2 (angle / 2) = aside^2 / (2 r (r + |along|)) on the way towards the lamp, cos^2 behind it.
    static HWY_INLINE V s_of(V along, V aside2, V r) {
      const D d;
      const V below = hn::Mul(hn::Add(r, r), hn::Add(r, hn::Abs(along)));
      const V near = hn::Sqrt(hn::Div(aside2, hn::Max(below, hn::Set(d, 1e-30f))));
      const V behind = hn::Sub(hn::Set(d, float(PhaseTable::kWhole)), near);
      return hn::IfThenElse(hn::Lt(along, hn::Zero(d)), near, behind);
    }

    void look(size_t v, V t) {
      const D d;
      const V along = hn::Sub(t, closest.get(v));
      const V r = hn::Sqrt(hn::MulAdd(along, along, aside2.get(v)));
      const V reach = hn::Max(r, hn::Set(d, float(scene->radius)));
      distance.set(v, r);
      irradiance.set(v, hn::Div(hn::Set(d, 1.0f), hn::Mul(reach, reach)));
      s.set(v, s_of(along, aside2.get(v), r));
    }

    V depth(size_t grid, size_t v, V t) const {
      const D d;
      V sum = hn::Zero(d);
      for (const Face& face : faces[grid]) {
        const V w = face.path.at(2, v, t), z = hn::Add(w, hn::Set(d, float(face.scene->w0)));
        const V inverse = hn::Div(hn::Set(d, 1.0f), hn::Max(z, hn::Set(d, 1e-20f)));
        const V x = hn::Mul(face.path.at(0, v, t), inverse), y = hn::Mul(face.path.at(1, v, t), inverse);
        const auto within = [&](V at, double lo, double hi) HWY_ATTR {
          return hn::And(hn::Ge(at, hn::Set(d, float(lo))), hn::Le(at, hn::Set(d, float(hi))));
        };
        const auto is_its_own =
            hn::And(hn::Gt(z, hn::Zero(d)), hn::And(within(x, face.scene->lo_u, face.scene->hi_u),
                                                    within(y, face.scene->lo_v, face.scene->hi_v)));
        if (hn::AllFalse(d, is_its_own)) continue;
        sum = hn::IfThenElse(is_its_own, face.reader.read(x, y, w), sum);
      }
      return sum;
    }

    const MarchLamp* scene;
    std::vector<std::vector<Face>> faces;  ///< [grid]
    PacketFloats closest, aside2;          ///< where each ray comes closest, and the distance there, squared
    PacketFloats distance, irradiance, s;  ///< of the steps looked at
    std::vector<PacketFloats> phases;      ///< [medium]: values of phase functions there
  };

  const Lamp& of(int light) const { return m_lamps[size_t(m_lamp_of[size_t(light)])]; }

  static HWY_INLINE V read(const PhaseTable& table, V s) {
    const D d;
    const DI di;
    if (table.is_constant()) return hn::Set(d, table.values[0]);
    const float intervals = float(table.values.size() - 1);
    const V x = hn::Min(hn::Max(hn::Mul(s, hn::Set(d, float(intervals / PhaseTable::kWhole))), hn::Zero(d)),
                        hn::Set(d, std::nextafter(intervals, 0.0f)));
    const VI node = truncate_small(x);
    const V near = hn::GatherIndex(d, table.values.data(), node),
            far = hn::GatherIndex(d, table.values.data(), hn::Add(node, hn::Set(di, 1)));
    return hn::MulAdd(hn::Sub(x, hn::ConvertTo(d, node)), hn::Sub(far, near), near);
  }

  const MarchScene& m_scene;
  std::span<const GridReader> m_grids;
  std::vector<int> m_lamp_of;  ///< [light]: -1 for suns
  std::vector<Lamp> m_lamps;

  // The present packet.
  double m_base = 0.0;
  double m_brightest = 0.0,
         m_other_light = 0.0;  ///< of any ray: all light, and what counts besides that of lamps
};

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
