#include "vdb_io/build_cloud.h"

#include <cmath>
#include <limits>
#include <memory>
#include <mutex>
#include <vector>

#include <fmt/format.h>
#include <openvdb/tools/Prune.h>

#include "lib/core/error.h"
#include "lib/core/parallel.h"
#include "lib/core/version.h"
#include "vdb_io/openvdb_library.h"

namespace pileus {

namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;
constexpr int kLeafEdge = int(Leaf::DIM);

/// Voxel indices up to here leave room for what readers add to them: half of the 32-bit range.
constexpr double kMaxIndex = 1 << 30;

[[noreturn]] void refuse(std::string message) {
  throw Error(ErrorKind::usage, SourceLoc{}, std::move(message));
}

/// First and last voxel index along each axis whose centre lies in the box. Floating: nothing is known yet.
struct VoxelRange {
  Vec3d first, last;

  VoxelRange(const Box3d& box, double voxel_size) {
    for (int axis = 0; axis < 3; ++axis) {
      first[axis] = std::ceil(box.min[axis] / voxel_size);
      last[axis] = std::floor(box.max[axis] / voxel_size);
    }
  }
  bool is_empty() const { return !(first.x <= last.x && first.y <= last.y && first.z <= last.z); }
  double count() const { return (last.x - first.x + 1) * (last.y - first.y + 1) * (last.z - first.z + 1); }
};

/// A voxel size, rounded up to two digits, with which the box stays within max_voxels.
double fitting_voxel_size(const Box3d& box, double max_voxels) {
  const Vec3d extent = box.size();
  double voxel_size = std::cbrt(extent.x / max_voxels * extent.y * extent.z);
  for (;; voxel_size *= 1.05) {
    const double digit = std::pow(10.0, std::floor(std::log10(voxel_size)) - 1);
    const double rounded = std::ceil(voxel_size / digit) * digit;
    if (VoxelRange(box, rounded).count() <= max_voxels) return rounded;
  }
}

VoxelRange checked_range(const Box3d& box, const CloudGridOptions& options) {
  const double voxel_size = options.voxel_size;
  if (!(voxel_size > 0) || !std::isfinite(voxel_size)) {
    refuse(fmt::format("voxel_size is {}; expected a finite length > 0", voxel_size));
  }
  const Vec3d extent = box.size();
  if (!std::isfinite(extent.length()) || !(extent.x > 0 && extent.y > 0 && extent.z > 0)) {
    refuse(fmt::format("the cloud's bounds measure {} x {} x {} m; expected finite lengths > 0", extent.x,
                       extent.y, extent.z));
  }
  const VoxelRange range(box, voxel_size);
  if (range.is_empty()) {
    refuse(fmt::format(
        "no voxel of size {} m lies in the cloud's bounds of {} x {} x {} m; expected a voxel_size "
        "of at most a tenth of that",
        voxel_size, extent.x, extent.y, extent.z));
  }
  if (!(range.count() <= double(options.max_voxels))) {
    refuse(fmt::format(
        "voxel_size = {} m makes a grid of {:.3g} voxels; expected at most {} (max_voxels); nearest "
        "voxel_size that fits: {:.2g} m",
        voxel_size, range.count(), options.max_voxels, fitting_voxel_size(box, double(options.max_voxels))));
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (!(-kMaxIndex <= range.first[axis] && range.last[axis] <= kMaxIndex)) {
      refuse(fmt::format(
          "the cloud reaches from {} to {} m along axis {}, too far out for voxels of {} m; expected "
          "at most {} voxels between the origin and the cloud",
          box.min[axis], box.max[axis], "xyz"[axis], voxel_size, kMaxIndex));
    }
  }
  return range;
}

/// Origins of the leaves in the range that may hold density, in a fixed order.
std::vector<openvdb::Coord> leaf_origins(const ProceduralCloud& cloud, const VoxelRange& range,
                                         double voxel_size) {
  const auto leaf_start = [](double index) { return int(index) & ~(kLeafEdge - 1); };
  std::vector<openvdb::Coord> origins;
  for (int x = leaf_start(range.first.x); x <= int(range.last.x); x += kLeafEdge) {
    for (int y = leaf_start(range.first.y); y <= int(range.last.y); y += kLeafEdge) {
      for (int z = leaf_start(range.first.z); z <= int(range.last.z); z += kLeafEdge) {
        const Box3d centres(voxel_size * Vec3d(x, y, z),
                            voxel_size * (Vec3d(x, y, z) + Vec3d(kLeafEdge - 1)));
        if (!cloud.is_empty(centres)) origins.emplace_back(x, y, z);
      }
    }
  }
  return origins;
}

/// The leaf at `origin` with its densities, or null where all are 0.
std::unique_ptr<Leaf> sample_leaf(const ProceduralCloud& cloud, const openvdb::Coord& origin,
                                  double voxel_size) {
  auto leaf = std::make_unique<Leaf>(origin, 0.0f);
  for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
    const openvdb::Coord voxel = leaf->offsetToGlobalCoord(i);
    const float rho = float(cloud.density(voxel_size * Vec3d(voxel.x(), voxel.y(), voxel.z())));
    if (rho > 0) leaf->setValueOn(i, rho);
  }
  if (leaf->isEmpty()) return nullptr;
  return leaf;
}

/// Counts finished leaves from any thread and passes every whole per cent on.
class Progress {
 public:
  Progress(size_t total, const std::function<bool(double)>& hook) : m_total(total), m_hook(hook) {}

  /// Throws Error(cancelled) where the hook says so.
  void one_done() {
    if (!m_hook) return;
    const std::lock_guard lock(m_mutex);
    const size_t percent_before = 100 * m_done / m_total;
    ++m_done;
    if (100 * m_done / m_total == percent_before) return;
    if (!m_hook(double(m_done) / double(m_total))) {
      throw Error(ErrorKind::cancelled, SourceLoc{}, "building the cloud was cancelled");
    }
  }

 private:
  size_t m_total;
  const std::function<bool(double)>& m_hook;
  std::mutex m_mutex;
  size_t m_done = 0;
};

}  // namespace

openvdb::FloatGrid::Ptr build_cloud(const ProceduralCloud& cloud, const CloudGridOptions& options) {
  initialize_openvdb();
  const VoxelRange range = checked_range(cloud.bounds(), options);
  const std::vector<openvdb::Coord> origins = leaf_origins(cloud, range, options.voxel_size);

  std::vector<std::unique_ptr<Leaf>> leaves(origins.size());
  Progress progress(origins.size(), options.progress);
  parallel_for(origins.size(), [&](size_t i) {
    leaves[i] = sample_leaf(cloud, origins[i], options.voxel_size);
    progress.one_done();
  });

  auto grid = openvdb::FloatGrid::create(0.0f);
  for (std::unique_ptr<Leaf>& leaf : leaves) {
    if (leaf) grid->tree().addLeaf(leaf.release());  // one after the other: the tree's order is fixed
  }
  openvdb::tools::prune(grid->tree());
  grid->setTransform(openvdb::math::Transform::createLinearTransform(options.voxel_size));
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->setName("density");
  grid->setCreator(fmt::format("pileus {}", kVersion));
  return grid;
}

}  // namespace pileus
