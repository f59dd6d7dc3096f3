#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace pileus {

/// Bits of a node of 2^kLog2Dim children or voxels along an edge, as the file has them: 64-bit words, z runs
/// fastest.
template <int kLog2Dim>
struct NodeMask {
  static constexpr int kWords = 1 << (3 * kLog2Dim - 6);
  std::array<uint64_t, kWords> words;

  uint32_t count() const {
    uint32_t total = 0;
    for (const uint64_t word : words) total += uint32_t(std::popcount(word));
    return total;
  }
  /// Calls visit(x, y, z) for every bit that is set.
  template <class Visit>
  void for_each(const Visit& visit) const {
    constexpr int kDim = 1 << kLog2Dim;
    for (int w = 0; w < kWords; ++w) {
      for (uint64_t rest = words[size_t(w)]; rest != 0; rest &= rest - 1) {
        const int n = 64 * w + std::countr_zero(rest);
        visit(n >> (2 * kLog2Dim), (n >> kLog2Dim) & (kDim - 1), n & (kDim - 1));
      }
    }
  }
};

using LeafMask = NodeMask<3>;

}  // namespace pileus
