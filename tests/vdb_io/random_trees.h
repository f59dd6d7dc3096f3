#pragma once

#include <limits>
#include <random>

#include <fmt/format.h>

#include "tests/vdb_io/vdb_test_files.h"

namespace pileus {

/// A tree of leaves and tiles of all levels, full and sparse, with inactive values of every kind that the
/// file format tells apart: the background, its negative, another value; two of these; many.
///   top: the level of the largest tiles; 3 are those of the root, too large for the bricks of a field
template <class Grid>
typename Grid::Ptr random_tree(unsigned seed, typename Grid::ValueType background, int top = 3) {
  using Value = typename Grid::ValueType;
  std::mt19937 random(seed);
  const auto below = [&](unsigned n) { return random() % n; };
  auto grid = make_grid<Grid>();
  grid->tree().root().setBackground(background, /*updateChildNodes=*/false);
  const auto any = [&] { return Value(int(below(2000)) - 300) / Value(std::is_integral_v<Value> ? 1 : 64); };
  const Value negative = openvdb::math::negative(background), first = any(), second = any();

  constexpr int kKinds = 7;
  const auto inactive = [&](int kind) -> Value {
    const bool other = below(2) == 1;
    switch (kind) {
      case 0:
        return background;
      case 1:
        return negative;
      case 2:
        return first;
      case 3:
        return other ? background : negative;
      case 4:
        return other ? background : first;
      case 5:
        return other ? second : first;
      default:
        return any();
    }
  };
  /// A place on a raster, in two of the root's nodes.
  const auto place = [&](int size, int range) {
    const auto one = [&] { return size * int(below(unsigned(range))); };
    return openvdb::Coord(one() - size * range / 2, one(), one());
  };
  for (int level = top; level >= 1; --level) {
    const int size = level == 3 ? 4096 : level == 2 ? 128 : 8;
    for (int i = 0; i < 20; ++i) {
      const openvdb::Coord at = place(size, level == 3 ? 4 : level == 2 ? 6 : 40);
      grid->tree().addTile(openvdb::Index(level), at, i % 3 == 0 ? any() : inactive(i % kKinds), i % 3 == 0);
    }
  }
  for (int i = 0; i < 70; ++i) {
    auto* leaf = grid->tree().touchLeaf(place(8, 40));
    const unsigned fill = i % 5 == 0 ? 100 : below(100);  // percent of active voxels
    const int kind = int(below(kKinds));
    for (openvdb::Index n = 0; n < 512; ++n) {
      const bool is_active = below(100) < fill;
      if (is_active) {
        leaf->setValueOn(n, any());
      } else {
        leaf->setValueOff(n, inactive(kind));
      }
    }
  }
  return grid;
}

}  // namespace pileus
