#pragma once

#include <array>
#include <cstdint>

#include "lib/core/large_array.h"
#include "lib/terrain/height_table.h"

namespace pileus {

/// What a surface is seen as from afar: blocks of 2^level x 2^level cells as bilinear patches between their
/// corners, where these deviate little from it, vertically. A block of level kUnit is a unit: its parts are
/// all of one level, so that they meet, and are looked up once. Larger blocks count by themselves. ref:
/// METHODS 6.4
class CoarsePatches {
 public:
  /// Larger units deviate more (of 16 x 16 cells: by a fifth, on rough ground), smaller ones are left sooner.
  static constexpr int kUnit = 3, kCoarsest = 5;

  CoarsePatches() = default;

  /// Built on all cores; the deviations do not depend on how many.
  ///   highest: the greatest absolute height
  CoarsePatches(const HeightTable& table, HeightInterpolation interpolation, float highest);

  /// HeightTable::patch of a level from 1 to kCoarsest, from a table of its own for each: corners of
  /// neighbouring blocks lie side by side.
  Patch<double> patch(int level, int i, int j) const { return m_corners[size_t(level - 1)].patch(i, j); }

  /// Not below the most by which patches of a level deviate in a unit, or the one patch of a level above
  /// kUnit; infinite where a part has no data. In a unit greater levels deviate by no less.
  ///   i, j: of the unit, or of the block
  float deviation(int level, int i, int j) const;

  /// What deviates by at most so much counts. Kept as it is compared.
  struct Allowance {
    uint16_t upper_half = 0;  ///< of a float, rounded down
  };
  ///   heights: >= 0
  static Allowance allowance(double heights);

  /// The level of the patches that count in a unit; 0: single cells.
  int level_of_unit(Allowance allowed, int i, int j) const {
    int level = 0;
    for (const uint16_t deviation : m_units[size_t(j) * size_t(m_corners[kUnit - 1].cells_x()) + size_t(i)])
      level += int(deviation <= allowed.upper_half);
    return level;
  }

  /// True where a block of a level above kUnit counts as one patch.
  bool counts(Allowance allowed, int level, int i, int j) const {
    return large(level, i, j) <= allowed.upper_half;
  }

 private:
  /// Upper halves of floats, rounded up, of levels from 1: ordered as the floats are.
  using Deviations = std::array<uint16_t, kUnit>;

  void add_corners(const HeightTable& table, int level);

  uint16_t large(int level, int i, int j) const {
    return m_large[size_t(level - kUnit - 1)]
                  [size_t(j) * size_t(m_corners[size_t(level - 1)].cells_x()) + size_t(i)];
  }

  std::array<HeightTable, kCoarsest> m_corners;
  LargeArray<Deviations> m_units;                               ///< [row][column]
  std::array<LargeArray<uint16_t>, kCoarsest - kUnit> m_large;  ///< [level - kUnit - 1][row][column]
};

}  // namespace pileus
