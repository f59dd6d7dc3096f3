#include "vdb_io/columns.h"

#include <algorithm>
#include <cmath>

#include "vdb_io/vdb_transform.h"

namespace pileus {
namespace {

constexpr double kMostColumns = 1 << 24;
constexpr int kEdge = 8;  // voxels of a leaf

Vec3i size_of(const Box3i& box) {
  return box.max - box.min + Vec3i(1);
}

/// Sums per line of voxels, for the three families of axis-parallel lines through a box.
class ColumnSums {
 public:
  explicit ColumnSums(const Box3i& box) : m_origin(box.min), m_size(size_of(box)) {
    for (int axis = 0; axis < 3; ++axis)
      m_sums[size_t(axis)].resize(size_t(m_size[(axis + 1) % 3]) * size_t(m_size[(axis + 2) % 3]));
  }

  void add(const GridVoxels::Leaf& leaf) {
    std::array<double, kEdge * kEdge> along[3] = {};  // [other axis][other axis], the later one faster
    for (int x = 0; x < kEdge; ++x) {
      for (int y = 0; y < kEdge; ++y) {
        for (int z = 0; z < kEdge; ++z) {
          const double value = density(leaf.values[(x * kEdge + y) * kEdge + z]);
          along[0][size_t(y * kEdge + z)] += value;
          along[1][size_t(x * kEdge + z)] += value;
          along[2][size_t(x * kEdge + y)] += value;
        }
      }
    }
    for (int axis = 0; axis < 3; ++axis) {
      const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
      for (int i = 0; i < kEdge; ++i) {
        for (int j = 0; j < kEdge; ++j) {
          const double sum = along[axis][size_t(i * kEdge + j)];
          if (sum > 0.0) add_line(axis, u, leaf.origin[u] + i, v, leaf.origin[v] + j, sum);
        }
      }
    }
  }

  void add(const VoxelTile& tile) {
    const double sum = density(tile.value) * tile.size;
    if (sum == 0.0) return;
    for (int axis = 0; axis < 3; ++axis) {
      const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
      for (int i = 0; i < tile.size; ++i) {
        for (int j = 0; j < tile.size; ++j) add_line(axis, u, tile.origin[u] + i, v, tile.origin[v] + j, sum);
      }
    }
  }

  /// Box of all lines that are not empty.
  Box3i bounds() const { return m_bounds; }

  /// The non-empty lines of an axis, sorted, times the voxel's edge.
  std::vector<double> take_sorted(int axis, double edge) {
    std::vector<double> sums = std::move(m_sums[size_t(axis)]);
    std::erase(sums, 0.0);
    for (double& sum : sums) sum *= edge;
    std::sort(sums.begin(), sums.end());
    return sums;
  }

 private:
  static double density(float value) { return std::isfinite(value) && value > 0.0f ? double(value) : 0.0; }

  /// The line along an axis at these places on the others, u before v.
  void add_line(int axis, int u, int at_u, int v, int at_v, double sum) {
    m_sums[size_t(axis)][size_t(at_u - m_origin[u]) * size_t(m_size[v]) + size_t(at_v - m_origin[v])] += sum;
    m_bounds.min[u] = std::min(m_bounds.min[u], at_u), m_bounds.max[u] = std::max(m_bounds.max[u], at_u);
    m_bounds.min[v] = std::min(m_bounds.min[v], at_v), m_bounds.max[v] = std::max(m_bounds.max[v], at_v);
  }

  Vec3i m_origin, m_size;
  Box3i m_bounds;
  std::array<std::vector<double>, 3> m_sums;
};

bool fits(const Box3i& box) {
  const auto edge = [&](int axis) { return double(box.max[axis]) - double(box.min[axis]) + 1.0; };
  return edge(0) * edge(1) <= kMostColumns && edge(1) * edge(2) <= kMostColumns &&
         edge(2) * edge(0) <= kMostColumns;
}

}  // namespace

Box3i box_of(const GridVoxels& voxels) {
  Box3i box;
  const auto add = [&](const Vec3i& origin, int size) {
    box.extendBy(origin);
    box.extendBy(origin + Vec3i(size - 1));
  };
  for (const GridVoxels::Leaf& leaf : voxels.leaves) add(leaf.origin, kEdge);
  for (const VoxelTile& tile : voxels.tiles) add(tile.origin, tile.size);
  return box;
}

double Columns::max() const {
  double largest = 0.0;
  for (const auto& columns : sorted) largest = columns.empty() ? largest : std::max(largest, columns.back());
  return largest;
}

double Columns::quantile(double fraction) const {
  double sum = 0.0;
  for (const auto& columns : sorted) {
    if (columns.empty()) return 0.0;
    sum += columns[size_t(std::ceil(fraction * double(columns.size() - 1)))];
  }
  return sum / 3.0;
}

std::optional<Columns> integrate_columns(const GridVoxels& voxels) {
  const Box3i box = box_of(voxels);
  if (box.isEmpty()) return Columns{};
  if (!fits(box)) return std::nullopt;
  ColumnSums sums(box);
  for (const GridVoxels::Leaf& leaf : voxels.leaves) sums.add(leaf);
  for (const VoxelTile& tile : voxels.tiles) sums.add(tile);
  Columns columns;
  columns.bounds = sums.bounds();
  const Vec3d edges = voxel_edges(voxels.world_from_index);
  for (int axis = 0; axis < 3; ++axis) columns.sorted[size_t(axis)] = sums.take_sorted(axis, edges[axis]);
  return columns;
}

}  // namespace pileus
