// Per-target include guard, as Highway needs it.
#if defined(PILEUS_LIB_NOISE_KERNELS_NOISE_POINTS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_LIB_NOISE_KERNELS_NOISE_POINTS_INL_H
#undef PILEUS_LIB_NOISE_KERNELS_NOISE_POINTS_INL_H
#else
#define PILEUS_LIB_NOISE_KERNELS_NOISE_POINTS_INL_H
#endif

#include <algorithm>
#include <cmath>

#include "hwy/highway.h"

#include "lib/noise/kernels/gradients-inl.h"
#include "lib/noise/kernels/noise_kernel.h"
#include "lib/noise/kernels/noise_sums-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using DI = hn::RebindToSigned<D>;
using VI = hn::Vec<DI>;

/// One coordinate of a vector of points, in the lattice of one octave.
struct LatticePlaces {
  V place, weight, weight_slope;
  VI lower,
      upper;  ///< hashes of the lattice coordinates beside the points, 0 .. 255

  /// Reduced in double precision; |x| < 2^51 lattice units, beyond that the hashes mean nothing.
  HWY_INLINE LatticePlaces(const double* x, double frequency, double shift, int period) {
    const DD dd;
    const D d;
    const hn::Half<D> half;
    const VD f = hn::Set(dd, frequency), s = hn::Set(dd, shift);
    // Twice, for the two halves of the vector.
    const VD x0 = hn::Add(hn::Mul(hn::Load(dd, x), f), s);
    const VD x1 = hn::Add(hn::Mul(hn::Load(dd, x + hn::Lanes(dd)), f), s);
    const VD whole0 = hn::Floor(x0), whole1 = hn::Floor(x1);
    place = hn::Combine(d, hn::DemoteTo(half, hn::Sub(x1, whole1)), hn::DemoteTo(half, hn::Sub(x0, whole0)));
    const VD one = hn::Set(dd, 1.0);
    if (period == 0) {
      lower = hash(whole0, whole1);
      upper = hn::And(hn::Add(lower, hn::Set(DI(), 1)), hn::Set(DI(), 255));
    } else {
      lower = hash(wrap(whole0, period), wrap(whole1, period));
      upper = hash(wrap(hn::Add(whole0, one), period), wrap(hn::Add(whole1, one), period));
    }
    // About the middle of the cell the polynomials do not cancel; both ends are met exactly.
    //   fade(1/2 + c) = 1/2 + c (15/8 - 5 c^2 + 6 c^4),  fade' = 30 (1/4 -
    //   c^2)^2
    const V c = hn::Sub(place, hn::Set(d, 0.5f)), c2 = hn::Mul(c, c);
    const V inner = hn::MulAdd(c2, hn::MulAdd(c2, hn::Set(d, 6.0f), hn::Set(d, -5.0f)), hn::Set(d, 1.875f));
    weight = hn::MulAdd(c, inner, hn::Set(d, 0.5f));
    const V bump = hn::Sub(hn::Set(d, 0.25f), c2);
    weight_slope = hn::Mul(hn::Set(d, 30.0f), hn::Mul(bump, bump));
  }

 private:
  /// Adding 1.5 * 2^52 leaves a whole number in the lowest bits of a double.
  static HWY_INLINE VI hash(VD whole0, VD whole1) {
    const DI di;
    const VD magic = hn::Set(DD(), 6755399441055744.0);
    const VI low = hn::BitCast(di, hn::Add(whole0, magic)), high = hn::BitCast(di, hn::Add(whole1, magic));
    return hn::And(hn::ConcatEven(di, high, low), hn::Set(di, 255));
  }

  /// 0 .. period - 1, also where the quotient was rounded up or down to the next whole number.
  static HWY_INLINE VD wrap(VD whole, int period) {
    const DD dd;
    const VD p = hn::Set(dd, double(period));
    VD rest = hn::Sub(whole, hn::Mul(p, hn::Floor(hn::Div(whole, p))));
    rest = hn::IfThenElse(hn::Lt(rest, hn::Zero(dd)), hn::Add(rest, p), rest);
    return hn::IfThenElse(hn::Ge(rest, p), hn::Sub(rest, p), rest);
  }
};

/// Noise, and with kGradient its derivatives, at a corner or mixed from corners.
template <bool kGradient>
struct Ramp {
  V value;
  V slope[kGradient ? 3 : 1];
};

/// lerp(weight, a, b), where the weight grows along `axis`.
template <int kAxis, bool kGradient>
HWY_INLINE Ramp<kGradient> mix(const LatticePlaces& at, const Ramp<kGradient>& a, const Ramp<kGradient>& b) {
  Ramp<kGradient> mixed;
  const V step = hn::Sub(b.value, a.value);
  mixed.value = hn::MulAdd(at.weight, step, a.value);
  if constexpr (kGradient) {
    for (int axis = 0; axis < 3; ++axis) {
      mixed.slope[axis] = hn::MulAdd(at.weight, hn::Sub(b.slope[axis], a.slope[axis]), a.slope[axis]);
    }
    mixed.slope[kAxis] = hn::MulAdd(at.weight_slope, step, mixed.slope[kAxis]);
  }
  return mixed;
}

/// Twice the noise at a vector of points. Without a period the lattice coordinates beside a point differ by
/// 1, so that one gather reads both hashes.
template <bool kGradient, bool kPeriodic>
class PointNoise {
 public:
  HWY_INLINE PointNoise(const NoiseTables& tables, const NoiseTurn& turn, const LatticePlaces& x,
                        const LatticePlaces& y, const LatticePlaces& z)
      : m_tables(tables), m_turn(turn), m_x(x), m_y(y), m_z(z) {}

  HWY_INLINE Ramp<kGradient> value() const {
    const Pair<VI> column = hashes(m_x.lower, m_x.upper);
    return mix<0, kGradient>(m_x, face(column.lower, m_x.place), face(column.upper, back(m_x)));
  }

 private:
  template <class T>
  struct Pair {
    T lower, upper;
  };

  static HWY_INLINE V back(const LatticePlaces& at) { return hn::Sub(at.place, hn::Set(D(), 1.0f)); }

  HWY_INLINE Pair<VI> hashes(VI lower, VI upper) const {
    const DI di;
    const VI byte = hn::Set(di, 255);
    const auto read = [&](VI index)
                          HWY_ATTR { return hn::GatherIndex(di, m_tables.hash_pair.data(), index); };
    const VI word = read(lower);
    return {hn::And(word, byte), kPeriodic ? hn::And(read(upper), byte) : hn::ShiftRight<8>(word)};
  }

  HWY_INLINE Ramp<kGradient> face(VI column, V x) const {
    const Pair<VI> row = hashes(hn::Add(column, m_y.lower), hn::Add(column, m_y.upper));
    return mix<1, kGradient>(m_y, edge(row.lower, x, m_y.place), edge(row.upper, x, back(m_y)));
  }

  HWY_INLINE Ramp<kGradient> edge(VI row, V x, V y) const {
    const D d;
    const VI lower = hn::Add(row, m_z.lower), upper = hn::Add(row, m_z.upper);
    Pair<GradientPick> pick = picks(m_turn.from, lower, upper);
    V near[3], far[3];
    for (int axis = 0; axis < 3; ++axis) {
      near[axis] = doubled_gradient(axis, pick.lower), far[axis] = doubled_gradient(axis, pick.upper);
    }
    if (m_turn.share > 0) {
      pick = picks(m_turn.to, lower, upper);
      const V share = hn::Set(d, m_turn.share);
      const auto turn = [&](V& g, V to) HWY_ATTR { g = hn::MulAdd(share, hn::Sub(to, g), g); };
      for (int axis = 0; axis < 3; ++axis) {
        turn(near[axis], doubled_gradient(axis, pick.lower)),
            turn(far[axis], doubled_gradient(axis, pick.upper));
      }
    }
    return mix<2, kGradient>(m_z, corner(near, x, y, m_z.place), corner(far, x, y, back(m_z)));
  }

  static HWY_INLINE Ramp<kGradient> corner(const V* g, V x, V y, V z) {
    Ramp<kGradient> ramp;
    ramp.value = hn::MulAdd(g[0], x, hn::MulAdd(g[1], y, hn::Mul(g[2], z)));
    if constexpr (kGradient) ramp.slope[0] = g[0], ramp.slope[1] = g[1], ramp.slope[2] = g[2];
    return ramp;
  }

  HWY_INLINE Pair<GradientPick> picks(int turn, VI lower, VI upper) const {
    const hn::RebindToUnsigned<D> du;
    const auto read = [&](VI index) HWY_ATTR {
      return hn::BitCast(du, hn::GatherIndex(DI(), m_tables.gradient_pair[turn].data(), index));
    };
    const GradientPick word = read(lower);
    return {gradient_pick(word), gradient_pick(kPeriodic ? read(upper) : hn::ShiftLeft<16>(word))};
  }

  const NoiseTables& m_tables;
  const NoiseTurn& m_turn;
  const LatticePlaces &m_x, &m_y, &m_z;
};

/// Octave sums at up to kLanes points: gradients (in world space) only with kGradient.
template <OctaveSum kKind, bool kGradient>
void sum_vector(const NoiseTables& tables, std::span<const NoiseOctave> octaves,
                std::span<const Vec3d> points, float* values, Vec3f* gradients) {
  const D d;
  HWY_ALIGN double p[3][kLanes];
  for (size_t i = 0; i < size_t(kLanes); ++i) {
    const Vec3d& point = points[std::min(i, points.size() - 1)];
    p[0][i] = point.x, p[1][i] = point.y, p[2][i] = point.z;
  }
  V sum = hn::Zero(d), slope[3] = {sum, sum, sum};
  for (const NoiseOctave& octave : octaves) {
    const LatticePlaces x(p[0], octave.frequency, octave.shift.x, octave.variant.period.x);
    const LatticePlaces y(p[1], octave.frequency, octave.shift.y, octave.variant.period.y);
    const LatticePlaces z(p[2], octave.frequency, octave.shift.z, octave.variant.period.z);
    const NoiseTurn& turn = octave.variant.turn;
    const Ramp<kGradient> doubled = octave.variant.period == Vec3i(0)
                                        ? PointNoise<kGradient, false>(tables, turn, x, y, z).value()
                                        : PointNoise<kGradient, true>(tables, turn, x, y, z).value();
    const OctaveShape<kKind> shape(octave.amplitude);
    const V scale = hn::Set(d, 0.5f * shape.scale);
    const V noise = hn::Mul(scale, doubled.value);
    sum = shape.add(sum, noise);
    if constexpr (kGradient) {
      const V frequency = hn::Mul(scale, hn::Set(d, float(octave.frequency)));
      for (int axis = 0; axis < 3; ++axis) {
        slope[axis] = hn::Add(slope[axis], shape.slope(noise, hn::Mul(frequency, doubled.slope[axis])));
      }
    }
  }
  HWY_ALIGN float lanes[4][kLanes];
  hn::Store(sum, d, lanes[0]);
  std::copy_n(lanes[0], points.size(), values);
  if constexpr (kGradient) {
    for (int axis = 0; axis < 3; ++axis) hn::Store(slope[axis], d, lanes[axis + 1]);
    for (size_t i = 0; i < points.size(); ++i) gradients[i] = Vec3f(lanes[1][i], lanes[2][i], lanes[3][i]);
  }
}

template <OctaveSum kKind, bool kGradient>
void sum_points(const NoiseTables& tables, std::span<const NoiseOctave> octaves,
                std::span<const Vec3d> points, float* values, Vec3f* gradients) {
  for (size_t i = 0; i < points.size(); i += size_t(kLanes)) {
    const auto some = points.subspan(i, std::min(size_t(kLanes), points.size() - i));
    sum_vector<kKind, kGradient>(tables, octaves, some, values + i, kGradient ? gradients + i : nullptr);
  }
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
