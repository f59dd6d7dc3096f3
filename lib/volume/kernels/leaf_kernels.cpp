#include "lib/volume/kernels/leaf_kernels.h"

#include <algorithm>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/volume/kernels/leaf_kernels.cpp"
#include "hwy/foreach_target.h"  // compiles this file again for each target
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// At most the eight voxels of a row.
using D = hn::CappedTag<float, 8>;
using DI = hn::RebindToSigned<D>;
using DI16 = hn::Rebind<int16_t, D>;
using V = hn::Vec<D>;
constexpr int kLanes = int(hn::MaxLanes(D()));

/// The largest of some rows' values, by their place in the row.
struct RowMaxima {
  V values[8 / kLanes];

  HWY_INLINE void clear() {
    for (V& value : values) value = hn::Zero(D());
  }
  HWY_INLINE void add(const float* row) {
    for (int i = 0; i < 8 / kLanes; ++i) values[i] = hn::Max(values[i], hn::LoadU(D(), row + i * kLanes));
  }
  HWY_INLINE void add(const RowMaxima& other) {
    for (int i = 0; i < 8 / kLanes; ++i) values[i] = hn::Max(values[i], other.values[i]);
  }
  HWY_INLINE V all() const {
    V most = values[0];
    for (int i = 1; i < 8 / kLanes; ++i) most = hn::Max(most, values[i]);
    return most;
  }
  /// Bit 0: something is not 0; bit 4: and so at the row's beginning.
  HWY_INLINE unsigned reached() const {
    const D d;
    const bool any = !hn::AllFalse(d, hn::Gt(all(), hn::Zero(d)));
    return (any ? 1u : 0u) | (hn::GetLane(values[0]) > 0.0f ? 16u : 0u);
  }
};

/// The largest values of a leaf's rows: of all, and of those that faces towards lower neighbours hold.
struct LeafMaxima {
  RowMaxima all, x_face, y_face, edge;

  HWY_INLINE void clear() { all.clear(), x_face.clear(), y_face.clear(), edge.clear(); }
  HWY_INLINE void add(const float* values) {
    for (int y = 0; y < 8; ++y) x_face.add(values + y * 8);
    all.add(x_face);
    edge.add(values);
    y_face.add(values);
    for (int x = 1; x < 8; ++x) {
      const float* const slice = values + x * 64;
      y_face.add(slice);
      for (int y = 1; y < 8; ++y) all.add(slice + y * 8);
    }
    all.add(y_face);
  }
  HWY_INLINE uint8_t reached() const {
    return uint8_t(all.reached() | x_face.reached() << 1 | y_face.reached() << 2 | edge.reached() << 3);
  }
};

float scan_leaves_impl(std::span<const VoxelLeaf> leaves, uint8_t* reached) {
  const D d;
  V most = hn::Zero(d);
  for (size_t i = 0; i < leaves.size(); ++i) {
    LeafMaxima maxima;
    maxima.clear();
    maxima.add(leaves[i].values);
    most = hn::Max(most, maxima.all.all());
    reached[i] = maxima.reached();
  }
  return hn::GetLane(hn::MaxOfLanes(d, most));
}

enum class Active { none, some, all };

/// What the values of a leaf say, by lane. Values that are not negative order like their bits.
struct LaneLook {
  hn::Vec<DI> any_bits = hn::Zero(DI()), highest_bits = hn::Zero(DI()), nonzero = hn::Zero(DI());
  V lowest = hn::Set(D(), std::numeric_limits<float>::infinity());
  V highest = hn::Set(D(), -std::numeric_limits<float>::infinity());

  HWY_INLINE LaneLook() {}  // its own, for an implied one would be made for the wrong instruction set

  /// The 64 values of a word of the mask.
  template <Active kActive>
  HWY_INLINE void add(const float* values, uint64_t mask) {
    const D d;
    const DI di;
    HWY_ALIGN static constexpr int32_t kPlaces[8] = {1, 2, 4, 8, 16, 32, 64, 128};
    for (int i = 0; i < 64; i += kLanes) {
      const V value = hn::LoadU(d, values + i);
      const auto bits = hn::BitCast(di, value);
      any_bits = hn::Or(any_bits, bits);
      highest_bits = hn::Max(highest_bits, bits);
      if constexpr (kActive == Active::all) {
        lowest = hn::Min(lowest, value);
        highest = hn::Max(highest, value);
      } else if constexpr (kActive == Active::none) {
        nonzero = hn::Sub(nonzero, hn::VecFromMask(di, hn::Gt(bits, hn::Zero(di))));
      } else {
        const auto row = hn::Set(di, int32_t(mask >> (i & ~7) & 0xff));
        const auto is_active = hn::TestBit(row, hn::Load(di, kPlaces + (i & 7)));
        const auto is_value = hn::RebindMask(d, is_active);
        lowest = hn::IfThenElse(is_value, hn::Min(lowest, value), lowest);
        highest = hn::IfThenElse(is_value, hn::Max(highest, value), highest);
        nonzero = hn::Sub(nonzero, hn::VecFromMask(di, hn::AndNot(is_active, hn::Gt(bits, hn::Zero(di)))));
      }
    }
  }
};

LeafLook look_at_leaf_impl(const float* values, const uint64_t* active) {
  const D d;
  const DI di;
  constexpr int32_t kLargestFinite = 0x7f7fffff;
  LeafMaxima maxima;
  maxima.clear();
  maxima.add(values);
  LaneLook lanes;
  for (int word = 0; word < 8; ++word) {
    if (active[word] == ~uint64_t(0)) {
      lanes.add<Active::all>(values + 64 * word, active[word]);
    } else if (active[word] == 0) {
      lanes.add<Active::none>(values + 64 * word, active[word]);
    } else {
      lanes.add<Active::some>(values + 64 * word, active[word]);
    }
  }
  LeafLook look;
  look.is_plain = hn::GetLane(hn::MinOfLanes(di, lanes.any_bits)) >= 0 &&
                  hn::GetLane(hn::MaxOfLanes(di, lanes.highest_bits)) <= kLargestFinite;
  look.reached = maxima.reached();
  look.largest = hn::GetLane(hn::MaxOfLanes(d, maxima.all.all()));
  look.lowest_active = hn::GetLane(hn::MinOfLanes(d, lanes.lowest));
  look.highest_active = hn::GetLane(hn::MaxOfLanes(d, lanes.highest));
  look.inactive_nonzero = uint32_t(hn::GetLane(hn::SumOfLanes(di, lanes.nonzero)));
  return look;
}

/// Some rows of one source: values[x * stride_x + y * stride_y + z].
struct RowSource {
  const float* values;
  int stride_x, stride_y;
};

/// Quantises value by value, and keeps account of what that changes.
class Quantizer {
 public:
  explicit Quantizer(double scale) : m_scale(float(scale)), m_inverse(float(1.0 / scale)) {}

  HWY_INLINE void quantize(const float* from, int16_t* to) const {
    store(steps_of(hn::LoadU(D(), from)), to);
  }

  HWY_INLINE void quantize_and_count(const float* from, int16_t* to) {
    const D d;
    const V value = hn::LoadU(d, from);
    const hn::Vec<DI> steps = steps_of(value);
    store(steps, to);
    m_sum = hn::Add(m_sum, value);
    m_errors = hn::Add(m_errors, hn::Sub(value, hn::Mul(hn::ConvertTo(d, steps), hn::Set(d, m_scale))));
  }

  double sum() const { return double(hn::GetLane(hn::SumOfLanes(D(), m_sum))); }
  double errors() const { return double(hn::GetLane(hn::SumOfLanes(D(), m_errors))); }

 private:
  HWY_INLINE hn::Vec<DI> steps_of(V value) const {
    return hn::NearestInt(hn::Mul(value, hn::Set(D(), m_inverse)));
  }
  HWY_INLINE static void store(hn::Vec<DI> steps, int16_t* to) {
    const DI16 d16;
    hn::StoreU(hn::DemoteTo(d16, hn::Sub(steps, hn::Set(DI(), 32768))), d16, to);
  }

  float m_scale, m_inverse;
  V m_sum = hn::Zero(D()), m_errors = hn::Zero(D());
};

void store_range(const int16_t* values, QuantizedBrick& brick) {
  const hn::ScalableTag<int16_t> d;
  auto lo = hn::Load(d, values), hi = lo;
  for (size_t i = hn::Lanes(d); i < size_t(kQuantizedPitch); i += hn::Lanes(d)) {
    const auto some = hn::Load(d, values + i);
    lo = hn::Min(lo, some);
    hi = hn::Max(hi, some);
  }
  alignas(64) int16_t los[hn::MaxLanes(d)], his[hn::MaxLanes(d)];
  hn::Store(lo, d, los);
  hn::Store(hi, d, his);
  brick.lo = *std::min_element(los, los + hn::Lanes(d));
  brick.hi = *std::max_element(his, his + hn::Lanes(d));
}

/// Means of 2^3 of a brick's own 8^3 values.
void store_means(const int16_t* values, int16_t* means) {
  const hn::FixedTag<int32_t, 4> d;
  const hn::FixedTag<int16_t, 4> d16;
  const auto load = [&](const int16_t* four) HWY_ATTR { return hn::PromoteTo(d, hn::LoadU(d16, four)); };
  for (int x = 0; x < 8; x += 2) {
    for (int y = 0; y < 8; y += 2, means += 4) {
      const int16_t *row = values + x * 81 + y * 9, *behind = row + 81;
      const auto lower = hn::Add(hn::Add(load(row), load(row + 9)), hn::Add(load(behind), load(behind + 9))),
                 upper = hn::Add(hn::Add(load(row + 4), load(row + 13)),
                                 hn::Add(load(behind + 4), load(behind + 13)));
      const auto sums = hn::Add(hn::ConcatEven(d, upper, lower), hn::ConcatOdd(d, upper, lower));
      hn::StoreU(hn::DemoteTo(d16, hn::ShiftRight<3>(hn::Add(sums, hn::Set(d, 4)))), d16, means);
    }
  }
}

QuantizedBrick quantize_brick_impl(const BrickSource& source, double scale, int16_t* values, int16_t* means) {
  alignas(64) float uniform[8][8];
  RowSource from[8];
  for (int n = 0; n < 8; ++n) {
    if (source.leaves[size_t(n)]) {
      from[n] = {source.leaves[size_t(n)], 64, 8};
    } else {
      std::fill_n(uniform[n], 8, source.uniform_values[size_t(n)]);
      from[n] = {uniform[n], 0, 0};
    }
  }
  Quantizer quantizer(scale);
  for (int x = 0; x < 8; ++x) {
    for (int y = 0; y < 8; ++y) {
      const float* const row = from[0].values + x * from[0].stride_x + y * from[0].stride_y;
      for (int z = 0; z < 8; z += kLanes) quantizer.quantize_and_count(row + z, values + x * 81 + y * 9 + z);
    }
  }
  const auto quantize_row = [&](int n, int x, int y) {
    const float* const row = from[n].values + (x & 7) * from[n].stride_x + (y & 7) * from[n].stride_y;
    for (int z = 0; z < 8; z += kLanes) quantizer.quantize(row + z, values + x * 81 + y * 9 + z);
  };
  for (int y = 0; y < 8; ++y) quantize_row(1, 8, y);
  for (int x = 0; x < 8; ++x) quantize_row(2, x, 8);
  quantize_row(3, 8, 8);

  // What ends the rows comes from the upper neighbours: all together first, because a row's is one value.
  constexpr int kEnds = 81;
  alignas(64) float ends[kEnds + 7];
  std::fill(ends + kEnds, ends + kEnds + 7, 0.0f);
  alignas(64) int16_t quantized[kEnds + 7];
  for (int x = 0; x < 9; ++x) {
    for (int y = 0; y < 9; ++y) {
      const RowSource& above = from[4 + (x >> 3) + 2 * (y >> 3)];
      ends[x * 9 + y] = above.values[(x & 7) * above.stride_x + (y & 7) * above.stride_y];
    }
  }
  for (int i = 0; i < kEnds; i += kLanes) quantizer.quantize(ends + i, quantized + i);
  for (int i = 0; i < kEnds; ++i) values[i * 9 + 8] = quantized[i];

  std::fill(values + 729, values + kQuantizedPitch, values[0]);
  QuantizedBrick brick;
  brick.sum = quantizer.sum();
  brick.errors = quantizer.errors();
  store_range(values, brick);
  store_means(values, means);
  return brick;
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pileus {

HWY_EXPORT(scan_leaves_impl);
HWY_EXPORT(look_at_leaf_impl);
HWY_EXPORT(quantize_brick_impl);

float scan_leaves(std::span<const VoxelLeaf> leaves, uint8_t* reached) {
  return HWY_DYNAMIC_DISPATCH(scan_leaves_impl)(leaves, reached);
}

LeafLook look_at_leaf(const float* values, const uint64_t* active) {
  return HWY_DYNAMIC_DISPATCH(look_at_leaf_impl)(values, active);
}

QuantizedBrick quantize_brick(const BrickSource& source, double scale, int16_t* values, int16_t* means) {
  return HWY_DYNAMIC_DISPATCH(quantize_brick_impl)(source, scale, values, means);
}

}  // namespace pileus
#endif
