#include "vdb_io/openvdb/columns.h"

#include <algorithm>
#include <cmath>

#include "vdb_io/openvdb/grid_values.h"

namespace pileus {
namespace {

constexpr double kMostColumns = 1 << 24;

/// Sums per line of voxels, for the three families of axis-parallel lines through a box.
class ColumnSums {
 public:
  explicit ColumnSums(const openvdb::CoordBBox& box) : m_box(box) {
    for (int axis = 0; axis < 3; ++axis) m_sums[size_t(axis)].resize(line_count(axis));
  }

  /// Adds a constant box of voxels.
  void add(const openvdb::CoordBBox& voxels, double value) {
    for (int axis = 0; axis < 3; ++axis) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      const double sum = value * double(voxels.max()[axis] - voxels.min()[axis] + 1);
      for (int j = voxels.min()[v]; j <= voxels.max()[v]; ++j) {
        const size_t row = size_t(j - m_box.min()[v]) * size_t(m_box.dim()[u]);
        for (int i = voxels.min()[u]; i <= voxels.max()[u]; ++i) {
          m_sums[size_t(axis)][row + size_t(i - m_box.min()[u])] += sum;
        }
      }
    }
  }

  /// The non-empty lines of an axis, sorted, times the voxel's edge.
  std::vector<double> take_sorted(int axis, double edge) {
    std::vector<double> sums = std::move(m_sums[size_t(axis)]);
    std::erase(sums, 0.0);
    for (double& sum : sums) sum *= edge;
    std::sort(sums.begin(), sums.end());
    return sums;
  }

 private:
  size_t line_count(int axis) const {
    return size_t(m_box.dim()[(axis + 1) % 3]) * size_t(m_box.dim()[(axis + 2) % 3]);
  }

  openvdb::CoordBBox m_box;
  std::array<std::vector<double>, 3> m_sums;
};

bool fits(const openvdb::CoordBBox& box) {
  const auto edge = [&](int axis) { return double(box.max()[axis]) - double(box.min()[axis]) + 1.0; };
  return edge(0) * edge(1) <= kMostColumns && edge(1) * edge(2) <= kMostColumns &&
         edge(2) * edge(0) <= kMostColumns;
}

}  // namespace

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

std::optional<Columns> integrate_columns(const openvdb::FloatGrid& grid, const Affine& world_from_index) {
  const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  if (box.empty() || !fits(box)) return box.empty() ? std::optional(Columns{}) : std::nullopt;
  ColumnSums sums(box);
  for (auto value = grid.cbeginValueOn(); value; ++value) {
    if (std::isfinite(*value) && *value > 0.0f) sums.add(value.getBoundingBox(), double(*value));
  }
  Columns columns;
  const Vec3d edges = voxel_edges(world_from_index);
  for (int axis = 0; axis < 3; ++axis) columns.sorted[size_t(axis)] = sums.take_sorted(axis, edges[axis]);
  return columns;
}

}  // namespace pileus
