#include "vdb_io/openvdb/resample.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include <openvdb/tools/SignedFloodFill.h>

#include "lib/core/error.h"
#include "lib/core/memory_budget.h"
#include "lib/core/overload.h"
#include "lib/core/parallel.h"
#include "vdb_io/openvdb/grid_values.h"

namespace pileus {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;

[[noreturn]] void fail(const std::filesystem::path& path, const openvdb::GridBase& grid,
                       const std::string& message) {
  throw Error(ErrorKind::file, path.string(), fmt::format("grid \"{}\" {}", grid.getName(), message));
}

/// An old voxel along an axis, and its share in a new one.
struct Tap {
  int index;
  double share;
};

/// The taps of new voxel `cell`: where new voxels are wider, the old ones that its cell covers, by how much;
/// else the two around its centre. `shift` is 0.5 for what stands half a voxel below its index.
std::vector<Tap> taps_of(double scale, int cell, double shift) {
  const double begin = scale * cell - 0.5 + shift, end = begin + scale;
  if (scale <= 1.0) {
    const double centre = 0.5 * (begin + end), below = std::floor(centre), rest = centre - below;
    std::vector<Tap> taps{{int(below), 1.0 - rest}};
    if (rest > 0.0) taps.push_back({int(below) + 1, rest});
    return taps;
  }
  constexpr double kNothing = 1e-9;  // [voxels]
  std::vector<Tap> taps;
  for (int i = int(std::floor(begin + 0.5)); i - 0.5 < end; ++i) {
    const double covered = std::min(end, i + 0.5) - std::max(begin, i - 0.5);
    if (covered > kNothing) taps.push_back({i, covered / scale});
  }
  return taps;
}

/// The taps of the eight cells of a leaf along each axis, in place and shifted.
class LeafTaps {
 public:
  LeafTaps(const openvdb::Vec3d& scale, const Coord& origin) {
    for (int axis = 0; axis < 3; ++axis) {
      for (int i = 0; i < 8; ++i) {
        m_taps[0][axis][i] = taps_of(scale[axis], origin[axis] + i, 0.0);
        m_taps[1][axis][i] = taps_of(scale[axis], origin[axis] + i, 0.5);
      }
    }
  }

  /// The weighted sum of read(old voxel) over the taps of a cell; `shifted` is an axis, or -1.
  template <class Read>
  double sum(const Coord& cell, int shifted, const Read& read) const {
    double sum = 0.0;
    for (const Tap& x : m_taps[shifted == 0][0][cell.x() & 7]) {
      for (const Tap& y : m_taps[shifted == 1][1][cell.y() & 7]) {
        for (const Tap& z : m_taps[shifted == 2][2][cell.z() & 7]) {
          sum += x.share * y.share * z.share * double(read(Coord(x.index, y.index, z.index)));
        }
      }
    }
    return sum;
  }

 private:
  std::vector<Tap> m_taps[2][3][8];
};

/// Resamples one grid. Index spaces: x_old = s * (x_new + 0.5) - 0.5 along each axis.
template <class Grid>
class Resampler {
  using Value = typename Grid::ValueType;
  using Leaf = typename Grid::TreeType::LeafNodeType;

 public:
  Resampler(const std::filesystem::path& path, const Grid& grid, const openvdb::Vec3d& scale)
      : m_path(path), m_grid(grid), m_scale(scale) {}

  typename Grid::Ptr run() const {
    const std::set<Coord> origins = leaf_origins();
    const auto result = Grid::create(m_grid.background());
    result->insertMeta(m_grid);
    std::vector<Leaf*> leaves;
    for (const Coord& origin : origins) leaves.push_back(result->tree().touchLeaf(origin));
    parallel_for(leaves.size(), [&](size_t i) { fill(*leaves[i]); });
    if constexpr (std::is_floating_point_v<Value>) {
      if (m_grid.getGridClass() == openvdb::GRID_LEVEL_SET) openvdb::tools::signedFloodFill(result->tree());
    }
    result->tree().prune();
    const openvdb::math::Transform::Ptr transform = m_grid.transform().copy();
    transform->preTranslate(0.5 * (m_scale - openvdb::Vec3d(1.0)));
    transform->preScale(m_scale);
    result->setTransform(transform);
    result->setSaveFloatAsHalf(false);
    if (m_grid.getGridClass() == openvdb::GRID_STAGGERED) result->setGridClass(openvdb::GRID_UNKNOWN);
    return result;
  }

 private:
  /// The new leaves that an active voxel of the old grid can reach.
  std::set<Coord> leaf_origins() const {
    const std::string what = fmt::format("grid \"{}\", on voxels of this size,", m_grid.getName());
    const std::string file = m_path.string();
    // What is certain comes first: counting leaves one by one up to the budget would take a while.
    const double voxels = double(m_grid.activeVoxelCount()) / (m_scale[0] * m_scale[1] * m_scale[2]);
    require_memory(file, what, uint64_t(std::min(voxels * sizeof(Value), 1e18)));
    std::set<Coord> origins;
    const auto add = [&](const CoordBBox& box) {
      Coord first, last;
      double leaves = 1.0;
      for (int axis = 0; axis < 3; ++axis) {
        first[axis] = int(std::floor((box.min()[axis] - 0.5) / m_scale[axis])) - 1;
        last[axis] = int(std::ceil((box.max()[axis] + 1.5) / m_scale[axis])) + 1;
        leaves *= ((last[axis] >> 3) - (first[axis] >> 3)) + 1.0;
      }
      leaves += double(origins.size());
      require_memory(file, what, uint64_t(std::min(leaves * sizeof(Leaf), 1e18)));
      for (int x = first.x() & ~7; x <= last.x(); x += 8) {
        for (int y = first.y() & ~7; y <= last.y(); y += 8) {
          for (int z = first.z() & ~7; z <= last.z(); z += 8) origins.insert(Coord(x, y, z));
        }
      }
    };
    for (auto leaf = m_grid.tree().cbeginLeaf(); leaf; ++leaf) {
      CoordBBox box;
      leaf->evalActiveBoundingBox(box);
      if (!box.empty()) add(box);
    }
    auto tile = m_grid.cbeginValueOn();
    tile.setMaxDepth(decltype(tile)::LEAF_DEPTH - 1);
    for (; tile; ++tile) add(tile.getBoundingBox());
    return origins;
  }

  void fill(Leaf& leaf) const {
    const auto accessor = m_grid.getConstAccessor();
    const LeafTaps taps(m_scale, leaf.origin());
    const bool is_level_set = m_grid.getGridClass() == openvdb::GRID_LEVEL_SET;
    for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) {
      const Value value = new_value(accessor, taps, leaf.offsetToGlobalCoord(n));
      bool is_active = value != m_grid.background();
      if constexpr (std::is_floating_point_v<Value>) {
        if (is_level_set) is_active = std::abs(value) < m_grid.background();
      }
      leaf.setValueOnly(n, value);
      leaf.setActiveState(n, is_active);
    }
  }

  template <class Accessor>
  Value new_value(const Accessor& accessor, const LeafTaps& taps, const Coord& cell) const {
    if constexpr (std::is_floating_point_v<Value>) {
      return Value(taps.sum(cell, -1, [&](const Coord& voxel) { return accessor.getValue(voxel); }));
    } else if constexpr (std::is_same_v<Value, openvdb::Vec3s>) {
      const bool is_staggered = m_grid.getGridClass() == openvdb::GRID_STAGGERED;
      Value value;
      for (int i = 0; i < 3; ++i) {
        value[i] = float(taps.sum(cell, is_staggered ? i : -1,
                                  [&](const Coord& voxel) { return accessor.getValue(voxel)[i]; }));
      }
      return value;
    } else {
      const openvdb::Vec3d centre = m_scale * (cell.asVec3d() + openvdb::Vec3d(0.5));
      return accessor.getValue(Coord::floor(centre));  // the cell of old voxel i begins at i
    }
  }

  const std::filesystem::path& m_path;
  const Grid& m_grid;
  openvdb::Vec3d m_scale;  ///< new edge over old one
};

openvdb::Vec3d scale_of(const std::filesystem::path& path, const openvdb::GridBase& grid,
                        const NewVoxels& voxels) {
  const Vec3d edges = voxel_edges(world_from_index(path, grid));
  openvdb::Vec3d scale;
  for (int axis = 0; axis < 3; ++axis) {
    scale[axis] = std::visit(Overload{[&](const VoxelEdge& edge) { return edge.meters / edges[axis]; },
                                      [](const VoxelFactor& factor) { return factor.factor; }},
                             voxels);
    if (!(scale[axis] >= 1e-3 && scale[axis] <= 1e3)) {
      fail(path, grid,
           fmt::format("would get voxels {:.3g} times as wide; expected 0.001 to 1000", scale[axis]));
    }
  }
  return scale;
}

openvdb::GridBase::Ptr resampled_once(const std::filesystem::path& path, const openvdb::GridBase& base,
                                      const openvdb::Vec3d& scale) {
  using Resampled = openvdb::TypeList<openvdb::FloatGrid, openvdb::DoubleGrid, openvdb::Vec3SGrid,
                                      openvdb::Int32Grid, openvdb::BoolGrid>;
  openvdb::GridBase::Ptr result;
  const bool is_known = base.apply<Resampled>(
      [&](const auto& grid) { result = Resampler<std::decay_t<decltype(grid)>>(path, grid, scale).run(); });
  if (!is_known) {
    fail(path, base,
         fmt::format("holds values of type {}; float, double, int32, bool and vec3s can be resampled",
                     base.valueType()));
  }
  return result;
}

}  // namespace

openvdb::GridBase::Ptr resampled_grid(const std::filesystem::path& path, const openvdb::GridBase& grid,
                                      const NewVoxels& voxels) {
  constexpr double kMostAtOnce = 4.0;  // a new voxel is a mean of 125 old ones at most: halve until that does
  openvdb::Vec3d scale = scale_of(path, grid, voxels);
  openvdb::GridBase::Ptr halved;
  const bool is_averaged = !grid.isType<openvdb::Int32Grid>() && !grid.isType<openvdb::BoolGrid>();
  while (is_averaged && std::max({scale[0], scale[1], scale[2]}) > kMostAtOnce) {
    openvdb::Vec3d step(1.0);
    for (int axis = 0; axis < 3; ++axis) step[axis] = scale[axis] > kMostAtOnce ? 2.0 : 1.0;
    halved = resampled_once(path, halved ? *halved : grid, step);
    scale = scale / step;
  }
  return resampled_once(path, halved ? *halved : grid, scale);
}

}  // namespace pileus
