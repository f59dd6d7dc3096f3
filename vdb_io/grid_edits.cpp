#include "vdb_io/grid_edits.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/SignedFloodFill.h>

#include "lib/core/error.h"
#include "lib/core/overload.h"
#include "lib/core/parallel.h"
#include "vdb_io/grid_values.h"

namespace pileus {
namespace {

using openvdb::Coord;
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

/// How a value is read between voxels.
template <class Value>
struct Reading {
  static constexpr bool kIsInterpolated =
      !std::is_integral_v<Value> && !std::is_same_v<Value, openvdb::Vec3i>;
};

template <class Accessor, class Value = typename Accessor::ValueType>
Value value_between(const Accessor& accessor, const openvdb::Vec3R& p, bool is_staggered) {
  if constexpr (std::is_same_v<Value, openvdb::Vec3s> || std::is_same_v<Value, openvdb::Vec3d>) {
    return is_staggered ? openvdb::tools::StaggeredBoxSampler::sample(accessor, p)
                        : openvdb::tools::BoxSampler::sample(accessor, p);
  } else if constexpr (Reading<Value>::kIsInterpolated) {
    return openvdb::tools::BoxSampler::sample(accessor, p);
  } else {
    return openvdb::tools::PointSampler::sample(accessor, p);
  }
}

/// Resamples one grid. Index spaces: x_old = s * (x_new + 0.5) - 0.5 along each axis.
template <class Grid>
class Resampler {
  using Value = typename Grid::ValueType;
  using Leaf = typename Grid::TreeType::LeafNodeType;

 public:
  Resampler(const std::filesystem::path& path, const Grid& grid, const openvdb::Vec3d& scale)
      : m_path(path), m_grid(grid), m_scale(scale) {
    for (int axis = 0; axis < 3; ++axis) {
      m_samples[axis] = Reading<Value>::kIsInterpolated ? std::max(1, int(std::ceil(scale[axis] - 1e-9))) : 1;
    }
  }

  typename Grid::Ptr run(uint64_t most_voxels) const {
    const std::set<Coord> origins = leaf_origins(most_voxels);
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
  std::set<Coord> leaf_origins(uint64_t most_voxels) const {
    std::set<Coord> origins;
    const auto add = [&](const CoordBBox& box) {
      Coord first, last;
      double leaves = 1.0;
      for (int axis = 0; axis < 3; ++axis) {
        first[axis] = int(std::floor((box.min()[axis] - 0.5) / m_scale[axis])) - 1;
        last[axis] = int(std::ceil((box.max()[axis] + 1.5) / m_scale[axis])) + 1;
        leaves *= ((last[axis] >> 3) - (first[axis] >> 3)) + 1.0;
      }
      if (512.0 * (leaves + double(origins.size())) > double(most_voxels) + 512.0 * 64) {
        fail(m_path, m_grid,
             fmt::format("would have more than {:.3g} voxels; choose larger ones, or crop first",
                         double(most_voxels)));
      }
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
    const bool is_level_set = m_grid.getGridClass() == openvdb::GRID_LEVEL_SET;
    for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) {
      const Value value = mean_over_cell(accessor, leaf.offsetToGlobalCoord(n));
      bool is_active = value != m_grid.background();
      if constexpr (std::is_floating_point_v<Value>) {
        if (is_level_set) is_active = std::abs(value) < m_grid.background();
      }
      leaf.setValueOnly(n, value);
      leaf.setActiveState(n, is_active);
    }
  }

  template <class Accessor>
  Value mean_over_cell(const Accessor& accessor, const Coord& cell) const {
    const bool is_staggered = m_grid.getGridClass() == openvdb::GRID_STAGGERED;
    const auto place = [&](int axis, int sample) {
      return m_scale[axis] * (cell[axis] + (sample + 0.5) / m_samples[axis]) - 0.5;
    };
    if (m_samples[0] * m_samples[1] * m_samples[2] == 1) {
      return value_between(accessor, openvdb::Vec3R(place(0, 0), place(1, 0), place(2, 0)), is_staggered);
    }
    if constexpr (Reading<Value>::kIsInterpolated) {
      using Sum = std::conditional_t<std::is_arithmetic_v<Value>, double, openvdb::Vec3d>;
      Sum sum(0.0);
      for (int i = 0; i < m_samples[0]; ++i) {
        for (int j = 0; j < m_samples[1]; ++j) {
          for (int k = 0; k < m_samples[2]; ++k) {
            sum += Sum(
                value_between(accessor, openvdb::Vec3R(place(0, i), place(1, j), place(2, k)), is_staggered));
          }
        }
      }
      return Value(sum * (1.0 / (double(m_samples[0]) * m_samples[1] * m_samples[2])));
    } else {
      PILEUS_CHECK(false);
      return Value(0);
    }
  }

  const std::filesystem::path& m_path;
  const Grid& m_grid;
  openvdb::Vec3d m_scale;    ///< new edge over old one
  openvdb::Vec3i m_samples;  ///< per cell and axis
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

openvdb::GridBase::Ptr resampled_grid(const std::filesystem::path& path, const openvdb::GridBase& base,
                                      const NewVoxels& voxels, uint64_t most_voxels) {
  const openvdb::Vec3d scale = scale_of(path, base, voxels);
  using Resampled = openvdb::TypeList<openvdb::FloatGrid, openvdb::DoubleGrid, openvdb::Vec3SGrid,
                                      openvdb::Int32Grid, openvdb::BoolGrid>;
  openvdb::GridBase::Ptr result;
  const bool is_known = base.apply<Resampled>([&](const auto& grid) {
    result = Resampler<std::decay_t<decltype(grid)>>(path, grid, scale).run(most_voxels);
  });
  if (!is_known) {
    fail(path, base,
         fmt::format("holds values of type {}; float, double, int32, bool and vec3s can be resampled",
                     base.valueType()));
  }
  return result;
}

}  // namespace pileus
