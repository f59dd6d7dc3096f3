#include "vdb_io/openvdb/build_cloud.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <openvdb/tools/Prune.h>

#include "lib/core/error.h"
#include "lib/core/memory_budget.h"
#include "lib/core/parallel.h"
#include "lib/core/version.h"
#include "vdb_io/openvdb/cloud_leaf.h"
#include "vdb_io/openvdb/cloud_nodes.h"
#include "vdb_io/openvdb/openvdb_library.h"

namespace pileus {

namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;
constexpr int kLeafEdge = int(Leaf::DIM);
constexpr int kBlockEdge = 128;  ///< voxels along a node of leaves
constexpr int kTaskEdge = 32;    ///< voxels along what one task evaluates

/// Voxel indices up to here leave room for what readers add to them: half of the 32-bit range.
constexpr double kMaxIndex = 1 << 30;

[[noreturn]] void refuse(std::string message) {
  throw Error(ErrorKind::usage, SourceLoc{}, std::move(message));
}

/// First and last voxel index along each axis whose centre lies in the box. Floating: nothing is known yet.
struct WideRange {
  Vec3d first, last;

  WideRange(const Box3d& box, double voxel_size) {
    for (int axis = 0; axis < 3; ++axis) {
      first[axis] = std::ceil(box.min[axis] / voxel_size);
      last[axis] = std::floor(box.max[axis] / voxel_size);
    }
  }
  bool is_empty() const { return !(first.x <= last.x && first.y <= last.y && first.z <= last.z); }
  double count() const { return (last.x - first.x + 1) * (last.y - first.y + 1) * (last.z - first.z + 1); }

  /// Once it is known to fit.
  VoxelRange range() const {
    return {{int(first.x), int(first.y), int(first.z)}, {int(last.x), int(last.y), int(last.z)}};
  }
};

/// Rounded up to two digits.
double rounded_up(double voxel_size) {
  const double digit = std::pow(10.0, std::floor(std::log10(voxel_size)) - 1);
  return std::ceil(voxel_size / digit) * digit;
}

/// A voxel size with which the box stays within max_voxels.
double fitting_voxel_size(const Box3d& box, double max_voxels) {
  const Vec3d extent = box.size();
  double voxel_size = std::cbrt(extent.x / max_voxels * extent.y * extent.z);
  for (;; voxel_size *= 1.05) {
    const double rounded = rounded_up(voxel_size);
    if (WideRange(box, rounded).count() <= max_voxels) return rounded;
  }
}

void check_extent(const Box3d& box) {
  const Vec3d extent = box.size();
  if (!std::isfinite(extent.length()) || !(extent.x > 0 && extent.y > 0 && extent.z > 0)) {
    refuse(fmt::format("the cloud's bounds measure {} x {} x {} m; expected finite lengths > 0", extent.x,
                       extent.y, extent.z));
  }
}

VoxelRange checked_range(const Box3d& box, double voxel_size, const CloudGridOptions& options) {
  if (!(voxel_size > 0) || !std::isfinite(voxel_size)) {
    refuse(fmt::format("voxel_size is {}; expected a finite length > 0", voxel_size));
  }
  check_extent(box);
  const WideRange range(box, voxel_size);
  if (range.is_empty()) {
    refuse(fmt::format(
        "no voxel of size {} m lies in the cloud's bounds of {} x {} x {} m; expected a voxel_size "
        "of at most a tenth of that",
        voxel_size, box.size().x, box.size().y, box.size().z));
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
  return range.range();
}

/// A tile of density 1 of the tree: 8, 128, … voxels along its edge.
void add_full_node(openvdb::FloatTree& tree, const VoxelNode& node) {
  const openvdb::Index level = node.edge >= kBlockEdge ? 2 : 1;
  const int edge = level == 2 ? kBlockEdge : kLeafEdge;
  for (int x = 0; x < node.edge; x += edge) {
    for (int y = 0; y < node.edge; y += edge) {
      for (int z = 0; z < node.edge; z += edge)
        tree.addTile(level, node.origin.offsetBy(x, y, z), 1.0f, true);
    }
  }
}

/// Adds nodes to a count, by how they were decided.
struct NodeCounts {
  const VoxelRange& range;
  CloudBuildCounters counters;

  void empty(const VoxelNode& node) { counters.empty_by_bound += range.count_in(node); }
  void full(const VoxelNode& node) { counters.full_by_bound += range.count_in(node); }
};

/// Collects what bounds leave of a block.
struct BlockSink : NodeCounts {
  std::vector<VoxelNode> full_nodes, tasks;

  void full(const VoxelNode& node) {
    NodeCounts::full(node);
    full_nodes.push_back(node);
  }
  void undecided(const VoxelNode& node, const CloudRegion&) { tasks.push_back(node); }
};

/// Evaluates the leaves that bounds leave of a task.
struct LeafSink : NodeCounts {
  const CloudNodes& nodes;
  std::vector<std::unique_ptr<Leaf>> leaves{};
  std::vector<VoxelNode> full_nodes{};

  void full(const VoxelNode& node) {
    NodeCounts::full(node);
    full_nodes.push_back(node);
  }

  void undecided(const VoxelNode& node, const CloudRegion& region) {
    std::array<float, Leaf::SIZE> rho;
    CloudLeaf(nodes, node, region).evaluate(rho, counters);
    if (std::all_of(rho.begin(), rho.end(), [](float value) { return value == 0.0f; })) return;
    const bool is_full = std::all_of(rho.begin(), rho.end(), [](float value) { return value == 1.0f; });
    if (is_full) return full_nodes.push_back(node);
    auto leaf = std::make_unique<Leaf>(node.origin, 0.0f);
    for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
      if (rho[i] > 0) leaf->setValueOn(i, rho[i]);
    }
    leaves.push_back(std::move(leaf));
  }
};

void add(CloudBuildCounters& sum, const CloudBuildCounters& part) {
  sum.empty_by_bound += part.empty_by_bound;
  sum.full_by_bound += part.full_by_bound;
  sum.evaluated += part.evaluated;
  sum.evaluated_empty += part.evaluated_empty;
  sum.noise_points += part.noise_points;
}

/// Origins of the blocks that hold a range, in a fixed order.
std::vector<VoxelNode> blocks_of(const VoxelRange& range) {
  const openvdb::Coord first = range.first & ~(kBlockEdge - 1);
  std::vector<VoxelNode> blocks;
  for (int x = first.x(); x <= range.last.x(); x += kBlockEdge) {
    for (int y = first.y(); y <= range.last.y(); y += kBlockEdge) {
      for (int z = first.z(); z <= range.last.z(); z += kBlockEdge) blocks.push_back({{x, y, z}, kBlockEdge});
    }
  }
  return blocks;
}

/// Counts finished tasks from any thread and passes every whole per cent on.
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

/// What bounds leave of all blocks: tasks in a fixed order; full nodes go into the tree at once.
std::vector<VoxelNode> tasks_of(const CloudNodes& nodes, openvdb::FloatTree& tree,
                                CloudBuildCounters& counters) {
  const std::vector<VoxelNode> blocks = blocks_of(nodes.range());
  std::vector<BlockSink> sinks(blocks.size(), BlockSink{{nodes.range(), {}}, {}, {}});
  parallel_for(blocks.size(), [&](size_t i) { nodes.decide(blocks[i], kTaskEdge, sinks[i]); });
  std::vector<VoxelNode> tasks;
  for (const BlockSink& sink : sinks) {
    add(counters, sink.counters);
    for (const VoxelNode& node : sink.full_nodes) add_full_node(tree, node);
    tasks.insert(tasks.end(), sink.tasks.begin(), sink.tasks.end());
  }
  return tasks;
}

/// Edge of the nodes that are counted for an estimate [voxels]: that of a leaf, or more where leaves would be
/// too many to look at. Even then a node is 1/80 of the cloud.
int counted_edge(const VoxelRange& range) {
  constexpr int64_t kMostNodes = 1 << 20;
  int edge = kLeafEdge;
  while (edge < kBlockEdge && range.count() / (int64_t(edge) * edge * edge) > kMostNodes) edge *= 2;
  return edge;
}

/// What of a grid bounds cannot rule out.
struct NodesLeft {
  double leaves = 0, blocks = 0;
};

NodesLeft count_nodes_left(const ProceduralCloud& cloud, double voxel_size, const VoxelRange& range) {
  struct Sink : NodeCounts {
    int64_t nodes = 0;
    void undecided(const VoxelNode&, const CloudRegion&) { ++nodes; }
  };
  const CloudNodes nodes(cloud, voxel_size, range);
  const std::vector<VoxelNode> blocks = blocks_of(range);
  const int edge = counted_edge(range);
  std::vector<Sink> sinks(blocks.size(), Sink{{range, {}}});
  parallel_for(blocks.size(), [&](size_t i) { nodes.decide(blocks[i], edge, sinks[i]); });
  NodesLeft left;
  for (const Sink& sink : sinks) {
    left.leaves += double(sink.nodes) * std::pow(edge / kLeafEdge, 3);
    if (sink.nodes > 0 || sink.counters.full_by_bound > 0) ++left.blocks;
  }
  return left;
}

/// How many nodes with this edge hold a range.
double count_nodes(const VoxelRange& range, int edge) {
  double count = 1;
  for (int axis = 0; axis < 3; ++axis)
    count *= std::floor(double(range.last[axis]) / edge) - std::floor(double(range.first[axis]) / edge) + 1;
  return count;
}

/// Memory of the finished grid at most [bytes]: leaves, blocks of them, and the nodes that hold the blocks.
/// Takes a look at the box alone where that shows that the grid stays within `enough`, or that no memory has
/// room for a note on each of its blocks.
double bound_on_bytes(const ProceduralCloud& cloud, double voxel_size, const CloudGridOptions& options,
                      double enough) {
  using Top = openvdb::FloatTree::RootNodeType::ChildNodeType;
  const VoxelRange range = checked_range(cloud.bounds(), voxel_size, options);
  const auto bytes_of = [&](const NodesLeft& nodes) {
    return nodes.leaves * double(sizeof(Leaf) + Leaf::SIZE * sizeof(float)) +
           nodes.blocks * double(sizeof(Top::ChildNodeType)) +
           count_nodes(range, int(Top::DIM)) * double(sizeof(Top));
  };
  const NodesLeft all{count_nodes(range, kLeafEdge), count_nodes(range, kBlockEdge)};
  const double notes = all.blocks * double(sizeof(VoxelNode) + sizeof(BlockSink));
  if (bytes_of(all) <= enough || notes > double(memory_budget())) return bytes_of(all);
  return bytes_of(count_nodes_left(cloud, voxel_size, range));
}

/// A voxel size with which the grid stays within max_bytes, and no voxel smaller than `least` [m]; none where
/// that leaves less than some voxels across the cloud.
std::optional<double> fitting_voxel_size(const ProceduralCloud& cloud, double least, double max_bytes,
                                         const CloudGridOptions& options) {
  // bytes ~ 1 / voxel_size^3, or to a lower power: this is how much larger voxels must be at least, roughly
  const auto excess = [&](double size) {
    return std::cbrt(bound_on_bytes(cloud, size, options, max_bytes) / max_bytes);
  };
  const Vec3d extent = cloud.bounds().size();
  const double coarsest = std::max(least, std::min({extent.x, extent.y, extent.z}) / 4);
  double voxel_size = std::max(least, coarsest / 4);
  for (int step = 0; step < 4 && voxel_size > least; ++step)
    voxel_size = std::clamp(voxel_size * excess(voxel_size), least, coarsest);
  while (voxel_size <= coarsest) {
    const double rounded = rounded_up(voxel_size), factor = excess(rounded);
    if (factor <= 1.0) return rounded;
    voxel_size *= std::max(1.05, factor);
  }
  return std::nullopt;
}

/// Refuses voxels with which the grid would exceed max_bytes, or the memory budget.
void check_memory(const ProceduralCloud& cloud, double voxel_size, const CloudGridOptions& options) {
  const uint64_t budget = memory_budget();
  const bool is_by_budget = options.max_bytes <= 0 || uint64_t(options.max_bytes) > budget;
  const uint64_t most = is_by_budget ? budget : uint64_t(options.max_bytes);
  const double bytes = bound_on_bytes(cloud, voxel_size, options, double(most));
  if (bytes <= double(most)) return;
  const uint64_t needed = uint64_t(std::min(bytes, 1e18));
  const auto fitting = fitting_voxel_size(cloud, voxel_size, double(most), options);
  refuse(fmt::format(
      "voxel_size = {} m{} makes a grid of {:.3g} voxels that takes up to {}; expected at most {} ({}){}{}",
      voxel_size, options.voxel_size == 0 ? ", the smallest that the limits allow," : "",
      WideRange(cloud.bounds(), voxel_size).count(), bytes_text(needed), bytes_text(most),
      is_by_budget ? "the memory budget" : "max_bytes",
      fitting ? fmt::format("; nearest voxel_size that fits: {:.2g} m", *fitting) : "",
      is_by_budget ? fmt::format("; or allow more with --memory {}", bytes_option(needed)) : ""));
}

/// options.voxel_size, or the smallest that the limits allow.
double chosen_voxel_size(const ProceduralCloud& cloud, const CloudGridOptions& options) {
  check_extent(cloud.bounds());
  if (options.voxel_size != 0) return options.voxel_size;
  const double by_voxels = fitting_voxel_size(cloud.bounds(), double(options.max_voxels));
  if (options.max_bytes <= 0) return by_voxels;
  const auto fitting = fitting_voxel_size(cloud, by_voxels, double(options.max_bytes), options);
  if (!fitting)
    refuse(fmt::format("no grid of the cloud is as small as {} (max_bytes)",
                       bytes_text(uint64_t(options.max_bytes))));
  return *fitting;
}

}  // namespace

openvdb::FloatGrid::Ptr build_cloud(const ProceduralCloud& cloud, const CloudGridOptions& options,
                                    CloudBuildCounters* counters) {
  initialize_openvdb();
  const double voxel_size = chosen_voxel_size(cloud, options);
  const VoxelRange range = checked_range(cloud.bounds(), voxel_size, options);
  check_memory(cloud, voxel_size, options);
  const CloudNodes nodes(cloud, voxel_size, range);
  auto grid = openvdb::FloatGrid::create(0.0f);

  CloudBuildCounters counts;
  counts.voxels = range.count();
  const std::vector<VoxelNode> tasks = tasks_of(nodes, grid->tree(), counts);
  std::vector<LeafSink> sinks;
  sinks.reserve(tasks.size());
  for (size_t i = 0; i < tasks.size(); ++i) sinks.push_back({{range, {}}, nodes});
  Progress progress(tasks.size(), options.progress);
  parallel_for(tasks.size(), [&](size_t i) {
    nodes.decide(tasks[i], kLeafEdge, sinks[i]);
    progress.one_done();
  });
  for (LeafSink& sink : sinks) {  // one after the other: the tree's order is fixed
    add(counts, sink.counters);
    for (const VoxelNode& node : sink.full_nodes) add_full_node(grid->tree(), node);
    for (std::unique_ptr<Leaf>& leaf : sink.leaves) grid->tree().addLeaf(leaf.release());
    sink.leaves.clear();
  }
  openvdb::tools::prune(grid->tree());
  if (counters) *counters = counts;
  grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel_size));
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->setName("density");
  grid->setCreator(fmt::format("pileus {}", kVersion));
  return grid;
}

}  // namespace pileus
