#include "vdb_io/openvdb/grid_edits.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>

#include <openvdb/tools/ChangeBackground.h>

#include "lib/core/error.h"
#include "vdb_io/openvdb/grid_types.h"
#include "vdb_io/openvdb/grid_values.h"

namespace pileus {
namespace {

using openvdb::CoordBBox;

[[noreturn]] void fail(const std::filesystem::path& path, const openvdb::GridBase& grid,
                       const std::string& message) {
  throw Error(ErrorKind::file, path.string(), fmt::format("grid \"{}\" {}", grid.getName(), message));
}

constexpr double kFarIndex = 1 << 30;

/// First and last voxel of an index axis whose centres m * i + b lie in [lo, hi], a rounding error aside.
void clip_axis(double m, double b, double lo, double hi, int& first, int& last) {
  constexpr double kRounding = 1e-6;  // [voxels]
  double from = (lo - b) / m, to = (hi - b) / m;
  if (from > to) std::swap(from, to);
  first = int(std::clamp(std::ceil(from - kRounding), -kFarIndex, kFarIndex));
  last = int(std::clamp(std::floor(to + kRounding), -kFarIndex, kFarIndex));
}

/// What becomes of a number; one type for all changes, lest each be compiled for each type of grid.
using Change = std::function<double(double)>;

/// A value whose numbers, one or three, went through `change`.
template <class Value>
Value changed(Value value, const Change& change) {
  if constexpr (std::is_floating_point_v<Value>) {
    return Value(change(double(value)));
  } else {
    for (int i = 0; i < 3; ++i) value[i] = typename Value::value_type(change(double(value[i])));
    return value;
  }
}

/// Calls edit(grid) with the type of a grid of floating numbers or vectors.
template <class Edit>
void edit_floats(const std::filesystem::path& path, openvdb::GridBase& base, const Edit& edit) {
  using Floats =
      openvdb::TypeList<openvdb::FloatGrid, openvdb::DoubleGrid, openvdb::Vec3SGrid, openvdb::Vec3DGrid>;
  if (base.apply<Floats>(edit)) return;
  fail(path, base,
       fmt::format("holds values of type {}; expected floating numbers or vectors", base.valueType()));
}

/// Puts every active value through `change`, and what is around through `change_around`: inactive values and
/// the background.
/// returns: the voxels whose values were changed
template <class Grid>
uint64_t change_values(Grid& grid, const Change& change, const Change& change_around) {
  uint64_t count = 0;
  const auto go = [&](auto& iterator, uint64_t voxels) {
    const auto old_value = *iterator;
    const auto new_value = changed(old_value, iterator.isValueOn() ? change : change_around);
    if (std::memcmp(&new_value, &old_value, sizeof(old_value)) == 0) return;  // NaN is itself here
    iterator.setValue(new_value);
    count += voxels;
  };
  auto& tree = grid.tree();
  for (auto leaf = tree.beginLeaf(); leaf; ++leaf) {
    for (auto value = leaf->beginValueAll(); value; ++value) go(value, 1);
  }
  auto tile = tree.beginValueAll();
  tile.setMaxDepth(decltype(tile)::LEAF_DEPTH - 1);
  for (; tile; ++tile) go(tile, tile.getVoxelCount());
  tree.root().setBackground(changed(tree.background(), change_around), /*updateChildNodes=*/false);
  return count;
}

template <class Grid>
uint64_t change_values(Grid& grid, const Change& change) {
  return change_values(grid, change, change);
}

/// Multiplies all values and the background; throws Error(file) where a product is too large for their type.
template <class Grid>
void multiply_all(const std::filesystem::path& path, Grid& grid, double factor) {
  using Value = typename Grid::ValueType;
  constexpr double kLargest =
      double(std::numeric_limits<typename openvdb::VecTraits<Value>::ElementType>::max());
  change_values(grid, [&](double old_value) {
    const double product = factor * old_value;
    if (std::isfinite(old_value) && std::abs(product) > kLargest) {
      fail(path, grid, fmt::format("holds {}, which is too large to be multiplied by {}", old_value, factor));
    }
    return product;
  });
}

/// Scales a grid's transform about the origin.
void scale_transform(const std::filesystem::path& path, openvdb::GridBase& grid, double factor) {
  constexpr double kWidest = 1e30;  // [m]: formats with 32-bit transforms hold it, and can invert it
  const Vec3d edges = factor * voxel_edges(world_from_index(path, grid));
  const auto refuse = [&] {
    fail(path, grid,
         fmt::format("would get voxels of {:.3g} x {:.3g} x {:.3g} m from --scale {}; expected edges of 2e-5 "
                     "to {} m",
                     edges.x, edges.y, edges.z, factor, kWidest));
  };
  if (!(std::max({edges.x, edges.y, edges.z}) <= kWidest)) refuse();
  try {
    grid.transform().postScale(factor);
  } catch (const openvdb::ArithmeticError&) {  // it takes maps of tiny voxels for singular
    refuse();
  }
}

}  // namespace

void crop_grid(const std::filesystem::path& path, openvdb::GridBase& grid, const Box3d& box) {
  const Affine to_world = world_from_index(path, grid);
  const Vec3d origin = to_world.point(Vec3d(0.0));
  CoordBBox kept;
  for (int axis = 0; axis < 3; ++axis) {
    Vec3d unit(0.0);
    unit[axis] = 1.0;
    const Vec3d step = to_world.direction(unit);
    int along = 0;
    for (int i = 1; i < 3; ++i) along = std::abs(step[i]) > std::abs(step[along]) ? i : along;
    for (int i = 0; i < 3; ++i) {
      if (i == along || std::abs(step[i]) <= 1e-9 * std::abs(step[along])) continue;
      fail(path, grid, "is turned or sheared against the world's axes; --crop needs one that is not");
    }
    clip_axis(step[along], origin[along], box.min[along], box.max[along], kept.min()[axis], kept.max()[axis]);
  }
  if (kept.empty()) {
    grid.clear();
  } else {
    grid.clip(kept);
  }
}

void scale_grid(const std::filesystem::path& path, openvdb::GridBase& grid, double factor) {
  scale_transform(path, grid, factor);
  if (grid.getGridClass() != openvdb::GRID_LEVEL_SET) return;
  using Distances = openvdb::TypeList<openvdb::FloatGrid, openvdb::DoubleGrid>;
  grid.apply<Distances>([&](auto& typed) { multiply_all(path, typed, factor); });
}

uint64_t replace_nan(const std::filesystem::path& path, openvdb::GridBase& grid, double value) {
  uint64_t count = 0;
  edit_floats(path, grid, [&](auto& typed) {
    count =
        change_values(typed, [=](double old_value) { return std::isfinite(old_value) ? old_value : value; });
  });
  return count;
}

uint64_t raise_to(const std::filesystem::path& path, openvdb::GridBase& grid, double lowest) {
  const auto to = [](double least) {
    return [=](double old_value) { return old_value < least ? least : old_value; };
  };
  uint64_t count = 0;
  edit_floats(path, grid,
              [&](auto& typed) { count = change_values(typed, to(lowest), to(std::min(lowest, 0.0))); });
  return count;
}

void multiply_values(const std::filesystem::path& path, openvdb::GridBase& grid, double factor) {
  edit_floats(path, grid, [&](auto& typed) { multiply_all(path, typed, factor); });
}

void change_background(const std::filesystem::path& path, openvdb::GridBase& grid, double value) {
  edit_floats(path, grid, [&](auto& typed) {
    using Value = typename std::decay_t<decltype(typed)>::ValueType;
    openvdb::tools::changeBackground(typed.tree(), changed(Value(0), [=](double) { return value; }));
  });
}

}  // namespace pileus
