// How optical depths become the nodes of lattices.
// Per-target include guard, as Highway needs it.
#if defined(PILEUS_INTEGRATORS_KERNELS_LATTICE_WRITER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PILEUS_INTEGRATORS_KERNELS_LATTICE_WRITER_INL_H
#undef PILEUS_INTEGRATORS_KERNELS_LATTICE_WRITER_INL_H
#else
#define PILEUS_INTEGRATORS_KERNELS_LATTICE_WRITER_INL_H
#endif

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "hwy/highway.h"

#include "integrators/kernels/readers-inl.h"
#include "integrators/kernels/sun_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Puts nodes into a lattice, brick by brick.
class LatticeWriter {
 public:
  static constexpr int kCells = SunLattice::kBrickCells;

  /// enough: depths beyond this count as this
  LatticeWriter(SunBricks& bricks, float enough) : m_bricks(bricks), m_enough(enough) {}

  /// Second differences between neighbours across the light and along it, so often, lower the nodes.
  struct Balance {
    float across, along;
  };

  /// Depths of nodes in a row along v, and of their neighbours.
  struct Rows {
    const float *here, *before, *after, *below, *above;  ///< along u, and along w; `here` reaches one further
  };

  /// The nodes of a row of a brick, balanced: linear interpolation lies above a convex
  /// function by h^2/12 of its second derivative on average. Node values
  /// lowered by as much, as their second differences tell it, leave errors of
  /// changing sign, which cancel along a view ray (Blu, Thevenaz, Unser 2004).
  /// What light meets at the edge of a cloud then becomes slightly negative:
  /// transmittance takes that as it is. More than slightly is the sign of a
  /// lattice too coarse to be corrected, and would brighten: there is a floor.
  void fill_row(const Rows& rows, const Balance& balance, uint16_t* out) const {
    const D d;
    const V two = hn::Set(d, 2.0f), four = hn::Set(d, 4.0f);
    const V share_across = hn::Set(d, balance.across), share_along = hn::Set(d, balance.along);
    // What a vector writes too much is overwritten by the next row.
    for (int v = 0; v <= kCells; v += int(kLanes)) {
      const V tau = hn::LoadU(d, rows.here + v);
      const V across = hn::Add(hn::Add(hn::LoadU(d, rows.before + v), hn::LoadU(d, rows.after + v)),
                               hn::Add(hn::LoadU(d, rows.here + v - 1), hn::LoadU(d, rows.here + v + 1)));
      const V along = hn::Add(hn::LoadU(d, rows.below + v), hn::LoadU(d, rows.above + v));
      const V lowered = hn::NegMulAdd(hn::NegMulAdd(four, tau, across), share_across,
                                      hn::NegMulAdd(hn::NegMulAdd(two, tau, along), share_along, tau));
      store_nodes(lowered, out + v);
    }
  }

  /// Stores a brick that somebody may read.
  void store(const Vec3i& brick, const uint16_t* nodes) {
    SunLattice& lattice = *m_bricks.lattice;
    const bool is_uniform =
        std::all_of(nodes + 1, nodes + kNodes, [&](uint16_t node) { return node == nodes[0]; });
    if (is_uniform && nodes[0] == lattice.nodes[kLight]) return skip(brick);
    if (is_uniform && nodes[0] == lattice.nodes[kDark]) {
      offset_of(brick) = kDark;
      return;
    }
    skip(brick);
    const int64_t slot = m_bricks.next.fetch_add(1);
    if (slot >= m_bricks.most) return;
    offset_of(brick) = int32_t(slot * SunLattice::kPitch);
    std::memcpy(lattice.nodes.get() + offset_of(brick), nodes, kNodes * sizeof(uint16_t));
  }

  /// A brick that nobody reads.
  void skip(const Vec3i& brick) { offset_of(brick) = kLight; }

 private:
  static constexpr size_t kNodes = 729;
  static constexpr int32_t kLight = 0,
                           kDark = SunLattice::kPitch;  ///< offsets of bricks that many share

  int32_t& offset_of(const Vec3i& brick) {
    SunLattice& lattice = *m_bricks.lattice;
    return lattice
        .offsets[(size_t(brick.x) * size_t(lattice.bricks.y) + size_t(brick.y)) * size_t(lattice.bricks.z) +
                 size_t(brick.z)];
  }

  void store_nodes(V tau, uint16_t* out) const {
    const D d;
    const DI di;
    const hn::Rebind<uint16_t, D> du16;
    const V shifted = hn::Add(hn::Min(hn::Max(tau, hn::Set(d, SunLattice::kLowest)), hn::Set(d, m_enough)),
                              hn::Set(d, SunLattice::kOffset));
    constexpr int kShift = SunLattice::kMantissaShift;
    const VI rounded =
        hn::Add(hn::BitCast(di, shifted), hn::Set(di, (1 << (kShift - 1)) - SunLattice::kExponentBias));
    hn::StoreU(hn::DemoteTo(du16, hn::ShiftRight<kShift>(rounded)), du16, out);
  }

  SunBricks& m_bricks;
  float m_enough;
};

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
