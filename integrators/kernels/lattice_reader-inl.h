// Optical depths of lattices, a vector of positions at a time.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_LATTICE_READER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_LATTICE_READER_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_LATTICE_READER_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_LATTICE_READER_INL_H
#endif

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "hwy/highway.h"

#include "integrators/kernels/sun_nodes.h"
#include "lib/simd/trilinear-inl.h"
#include "lib/simd/truncate-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Optical depths of a lattice; positions beyond it count as its border.
class LatticeReader {
  using D = hn::ScalableTag<float>;
  using DI = hn::RebindToSigned<D>;
  using V = hn::Vec<D>;
  using VI = hn::Vec<DI>;
  static constexpr size_t kLanes = hn::MaxLanes(D());

 public:
  explicit LatticeReader(const SunLattice& lattice)
      : m_nodes(reinterpret_cast<const int16_t*>(lattice.nodes.get())),
        m_offsets(lattice.offsets.data()),
        m_stride_u(lattice.bricks.y * lattice.bricks.z),
        m_stride_v(lattice.bricks.z) {
    // Below the last node, so that its cell exists.
    for (int axis = 0; axis < 3; ++axis)
      m_last[axis] = std::nextafter(float(lattice.bricks[axis] * SunLattice::kBrickCells), 0.0f);
  }

  /// Where the depths of a vector of positions are: GridReader::Cells.
  struct Cells {
    alignas(64) int32_t bricks[kLanes];
    alignas(64) int32_t cells[kLanes];
    V fu, fv, fw;
  };

  HWY_INLINE Cells locate(V u, V v, V w) const {
    const D d;
    const DI di;
    u = clamp(u, 0), v = clamp(v, 1), w = clamp(w, 2);
    const VI cu = truncate_small(u), cv = truncate_small(v), cw = truncate_small(w);
    const VI brick = hn::Add(hn::Add(hn::Mul(hn::ShiftRight<3>(cu), hn::Set(di, m_stride_u)),
                                     hn::Mul(hn::ShiftRight<3>(cv), hn::Set(di, m_stride_v))),
                             hn::ShiftRight<3>(cw));
    const VI seven = hn::Set(di, SunLattice::kBrickCells - 1);
    const VI cell = hn::Add(hn::Add(hn::Mul(hn::And(cu, seven), hn::Set(di, SunLattice::kStrideU)),
                                    hn::Mul(hn::And(cw, seven), hn::Set(di, SunLattice::kStrideW))),
                            hn::And(cv, seven));
    Cells cells;
    hn::Store(brick, di, cells.bricks);
    hn::Store(cell, di, cells.cells);
    cells.fu = hn::Sub(u, hn::ConvertTo(d, cu));
    cells.fv = hn::Sub(v, hn::ConvertTo(d, cv));
    cells.fw = hn::Sub(w, hn::ConvertTo(d, cw));
    return cells;
  }

  HWY_INLINE V read(V u, V v, V w) const { return read(locate(u, v, w)); }

  HWY_INLINE V read(const Cells& cells) const {
    const D d;
    const int16_t* at[kLanes];
    for (size_t i = 0; i < kLanes; ++i)
      at[i] = m_nodes + uint32_t(m_offsets[uint32_t(cells.bricks[i])] + cells.cells[i]);
    constexpr int kU = SunLattice::kStrideU, kW = SunLattice::kStrideW;
    const auto edges = load_edges(DI(), at, kU, kW);
    const V c00 = along_edge(edges.words[0], cells.fv), c01 = along_edge(edges.words[1], cells.fv);
    const V c10 = along_edge(edges.words[2], cells.fv), c11 = along_edge(edges.words[3], cells.fv);
    return hn::Sub(lerp(lerp(c00, c01, cells.fw), lerp(c10, c11, cells.fw), cells.fu),
                   hn::Set(d, SunLattice::kOffset));
  }

 private:
  HWY_INLINE V clamp(V x, int axis) const {
    const D d;
    return hn::Max(hn::Zero(d), hn::Min(x, hn::Set(d, m_last[axis])));
  }

  static HWY_INLINE V lerp(V a, V b, V s) { return hn::MulAdd(s, hn::Sub(b, a), a); }

  /// Between a node and its neighbour along v: one word holds both.
  static HWY_INLINE V along_edge(VI both, V fv) {
    const D d;
    const DI di;
    const hn::RebindToUnsigned<D> du;
    const VI bias = hn::Set(di, SunLattice::kExponentBias);
    constexpr int kShift = SunLattice::kMantissaShift;
    const auto bits = hn::BitCast(du, both);
    const VI lower = hn::BitCast(di, hn::ShiftRight<16 - kShift>(hn::ShiftLeft<16>(bits)));
    const VI upper = hn::BitCast(di, hn::ShiftLeft<kShift>(hn::ShiftRight<16>(bits)));
    return lerp(hn::BitCast(d, hn::Add(lower, bias)), hn::BitCast(d, hn::Add(upper, bias)), fv);
  }

  const int16_t* m_nodes;  ///< bits, whatever their sign
  const int32_t* m_offsets;
  int m_stride_u, m_stride_v;  ///< of the table
  float m_last[3];
};

inline std::vector<LatticeReader> lattice_readers(std::span<const SunLattice> lattices) {
  return {lattices.begin(), lattices.end()};
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
