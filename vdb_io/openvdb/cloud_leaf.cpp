#include "vdb_io/openvdb/cloud_leaf.h"

#include <algorithm>
#include <span>

namespace pileus {

namespace {

constexpr size_t kPartVoxels = CloudLeaf::kPartEdge * CloudLeaf::kPartEdge * CloudLeaf::kPartEdge;

const std::array<float, kPartVoxels> kOnes = [] {
  std::array<float, kPartVoxels> ones;
  ones.fill(1.0f);
  return ones;
}();

}  // namespace

CloudLeaf::CloudLeaf(const CloudNodes& nodes, const VoxelNode& leaf, const CloudRegion& region)
    : m_nodes(nodes), m_leaf(leaf), m_region(region) {
  for (size_t n = 0; n < m_parts.size(); ++n) {
    m_parts[n] = Part::outside;
    if (nodes.range().count_in(part(n)) == 0) continue;
    const CloudRegion inner = region.within(nodes.box(part(n)));
    m_parts[n] = inner.is_empty() ? Part::empty : inner.is_full() ? Part::full : Part::undecided;
  }
}

VoxelNode CloudLeaf::part(size_t number) const {
  const int n = int(number);
  return {m_leaf.origin.offsetBy(kPartEdge * (n >> 2), kPartEdge * (n >> 1 & 1), kPartEdge * (n & 1)),
          kPartEdge};
}

void CloudLeaf::count(CloudBuildCounters& counters) const {
  for (size_t n = 0; n < m_parts.size(); ++n) {
    const int64_t voxels = m_nodes.range().count_in(part(n));
    if (m_parts[n] == Part::empty) counters.empty_by_bound += voxels;
    if (m_parts[n] == Part::full) counters.full_by_bound += voxels;
    if (m_parts[n] == Part::undecided) counters.evaluated += voxels;
  }
}

void CloudLeaf::fill_block(const openvdb::Coord& first, const Vec3i& size, std::span<const float> values,
                           std::array<float, kVoxels>& rho) const {
  const openvdb::Coord at = first - m_leaf.origin;
  auto value = values.begin();
  for (int x = at.x(); x < at.x() + size.x; ++x) {
    for (int y = at.y(); y < at.y() + size.y; ++y) {
      std::copy_n(value, size.z, rho.begin() + (x * kEdge + y) * kEdge + at.z());
      value += size.z;
    }
  }
}

void CloudLeaf::evaluate_block(const openvdb::Coord& first, const Vec3i& size,
                               std::array<float, kVoxels>& rho, CloudBuildCounters& counters) const {
  std::array<float, kVoxels> all;
  const std::span values(all.data(), size_t(size.x) * size_t(size.y) * size_t(size.z));
  counters.noise_points += m_region.densities(m_nodes.points(first, size), values);
  fill_block(first, size, values, rho);
  const VoxelRange block{first, first.offsetBy(size.x - 1, size.y - 1, size.z - 1)};
  const int64_t outside = block.count() - m_nodes.range().count_in(block);
  counters.evaluated_empty += std::count(values.begin(), values.end(), 0.0f) - outside;
}

void CloudLeaf::evaluate(std::array<float, kVoxels>& rho, CloudBuildCounters& counters) const {
  count(counters);
  const auto is_open = [](Part part) { return part == Part::undecided; };
  if (std::all_of(m_parts.begin(), m_parts.end(), is_open)) {
    evaluate_block(m_leaf.origin, Vec3i(kEdge), rho, counters);
    return;
  }
  rho.fill(0.0f);
  for (size_t column = 0; column < m_parts.size(); column += 2) {
    const bool low = is_open(m_parts[column]), high = is_open(m_parts[column + 1]);
    const Vec3i size(kPartEdge, kPartEdge, low && high ? kEdge : kPartEdge);
    if (low || high) evaluate_block(part(low ? column : column + 1).origin, size, rho, counters);
    for (const size_t n : {column, column + 1}) {
      if (m_parts[n] == Part::full) fill_block(part(n).origin, Vec3i(kPartEdge), kOnes, rho);
    }
  }
}

}  // namespace pileus
