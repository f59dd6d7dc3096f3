#include "vdb_io/vdb_voxels.h"

#include <algorithm>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "lib/core/error.h"
#include "lib/core/large_array.h"
#include "lib/core/memory_budget.h"
#include "lib/core/parallel.h"
#include "vdb_io/file_stretches.h"
#include "vdb_io/node_unpacker.h"
#include "vdb_io/vdb_transform.h"
#include "vdb_io/vdb_tree.h"

namespace pileus {
namespace {

constexpr size_t kLeafVoxels = 512;

/// Room for a stretch of the file.
using FileBytes = std::vector<char, LargeAllocator<char>>;

class VoxelReader {
 public:
  VoxelReader(const std::filesystem::path& path, const VdbGridEntry& grid, const TreeLayout& tree)
      : m_path(path), m_grid(grid), m_tree(tree), m_file(path) {
    m_coding.type = value_type_from(grid.value_type).value();
    m_coding.is_half = grid.saved_as_half;
    m_coding.compression = grid.compression;
    m_background.resize(m_coding.value_bytes());
    m_file.read(tree.background, m_background);
  }

  GridVoxels read() {
    NodeUnpacker unpacker = make_unpacker();
    m_voxels.background = unpacker.value(m_background.data());
    m_voxels.active_voxels = m_tree.structure.active_voxels;
    for (const RootTileLayout& tile : m_tree.root_tiles) read_root_tile(tile, unpacker);
    for (const NodeLayout& node : m_tree.nodes) read_tiles(node, unpacker);
    read_leaves();
    m_voxels.counts = m_tally.counts();
    return std::move(m_voxels);
  }

 private:
  [[noreturn]] void damaged() const {
    throw Error(
        ErrorKind::file, m_path.string(),
        fmt::format("is damaged: grid \"{}\": its voxels do not unpack; fetch the file again", m_grid.name));
  }

  NodeUnpacker make_unpacker() const { return {m_coding, m_background}; }

  void add_tile(const Vec3i& origin, int size, float value, bool is_active) {
    const auto edge = uint64_t(size);
    m_tally.add(value, is_active, edge * edge * edge);
    if (value == 0.0f) return;
    m_voxels.tiles.push_back({origin, size, value});
  }

  void read_root_tile(const RootTileLayout& tile, const NodeUnpacker& unpacker) {
    constexpr int kSize = 4096;
    char value[sizeof(double)];
    m_file.read(tile.value, {value, m_coding.value_bytes()});
    add_tile(tile.origin, kSize, unpacker.value(value), tile.is_active);
  }

  void read_tiles(const NodeLayout& node, NodeUnpacker& unpacker) {
    m_bytes.resize(node.values.end - node.values.begin);
    m_file.read(node.values.begin, m_bytes);
    m_values.resize(64 * node.active.size());
    if (!unpacker.unpack(m_bytes, node.active, m_values)) damaged();
    const int log2_dim = node.child_size == 8 ? 4 : 5, last = (1 << log2_dim) - 1;
    for (size_t n = 0; n < m_values.size(); ++n) {
      const uint64_t bit = uint64_t(1) << (n & 63);
      const bool is_active = (node.active[n >> 6] & bit) != 0;
      const bool is_nothing = m_values[n] == 0.0f && !is_active;
      if (is_nothing || (node.children[n >> 6] & bit) != 0) continue;
      const Vec3i place(int(n) >> (2 * log2_dim), int(n) >> log2_dim & last, int(n) & last);
      add_tile(node.origin + place * node.child_size, node.child_size, m_values[n], is_active);
    }
    require_memory(m_path.string(), fmt::format("grid \"{}\"", m_grid.name),
                   m_tree.structure.memory_bytes + m_voxels.tiles.size() * sizeof(VoxelTile));
  }

  /// What comes of some leaves that lie one behind the other.
  struct Chunk {
    ValueTally tally;
    std::vector<GridVoxels::Leaf> leaves;
    std::vector<uint8_t> reached;
    float largest = 0.0f;
    bool is_damaged = false;
  };

  void read_leaves() {
    constexpr size_t kLeavesPerChunk = 64;
    const size_t leaves = m_tree.leaves.size();
    auto values = std::make_shared<LargeArray<float>>(make_large_array<float>(leaves * kLeafVoxels));
    std::vector<Chunk> chunks((leaves + kLeavesPerChunk - 1) / kLeavesPerChunk);
    parallel_for(chunks.size(), [&](size_t i) {
      const size_t first = i * kLeavesPerChunk, count = std::min(kLeavesPerChunk, leaves - first);
      read_chunk(std::span(m_tree.leaves).subspan(first, count), values->get() + first * kLeafVoxels,
                 chunks[i]);
    });
    for (const Chunk& chunk : chunks) {
      if (chunk.is_damaged) damaged();
      m_tally.add(chunk.tally);
      m_voxels.leaves.insert(m_voxels.leaves.end(), chunk.leaves.begin(), chunk.leaves.end());
      m_voxels.scan.reached.insert(m_voxels.scan.reached.end(), chunk.reached.begin(), chunk.reached.end());
      m_voxels.scan.max_value = std::max(m_voxels.scan.max_value, chunk.largest);
    }
    m_voxels.owner = std::move(values);
  }

  /// A leaf of zeros leaves its place to the next one.
  void read_chunk(std::span<const LeafLayout> leaves, float* values, Chunk& chunk) const {
    const uint64_t begin = leaves.front().values.begin;
    FileBytes bytes(leaves.back().values.end - begin);
    m_file.read(begin, bytes);
    NodeUnpacker unpacker = make_unpacker();
    for (const LeafLayout& leaf : leaves) {
      const std::span stored(bytes.data() + (leaf.values.begin - begin), leaf.values.end - leaf.values.begin);
      if (m_coding.type == ValueCoding::Type::boolean) {
        spread_bits(stored, values);
      } else if (!unpacker.unpack(stored, leaf.active.words, {values, kLeafVoxels})) {
        chunk.is_damaged = true;
        return;
      }
      const ValueTally::Leaf look = chunk.tally.add_leaf(values, leaf.active.words.data());
      if (look.is_zero) continue;
      chunk.leaves.push_back({leaf.origin, values});
      chunk.reached.push_back(look.reached);
      chunk.largest = std::max(chunk.largest, look.largest);
      values += kLeafVoxels;
    }
  }

  /// A leaf of bools holds a bit for each.
  static void spread_bits(std::span<const char> bytes, float* values) {
    for (size_t n = 0; n < kLeafVoxels; ++n)
      values[n] = (static_cast<unsigned char>(bytes[n >> 3]) >> (n & 7) & 1) != 0 ? 1.0f : 0.0f;
  }

  const std::filesystem::path& m_path;
  const VdbGridEntry& m_grid;
  const TreeLayout& m_tree;
  FileStretches m_file;
  ValueCoding m_coding;
  std::vector<char> m_background;
  FileBytes m_bytes;
  std::vector<float> m_values;  ///< of a node's tiles
  ValueTally m_tally;
  GridVoxels m_voxels;
};

}  // namespace

GridVoxels read_vdb_voxels(const std::filesystem::path& path, const VdbDirectory& directory,
                           const VdbGridEntry& entry) {
  PILEUS_CHECK(entry.is_scalar());
  const TreeLayout tree = read_checked_tree(path, directory, entry);
  const Affine world_from_index = read_world_from_index(path, entry);
  try {
    GridVoxels voxels = VoxelReader(path, voxel_owner(path, directory, entry), tree).read();
    voxels.world_from_index = world_from_index;
    return voxels;
  } catch (const std::bad_alloc&) {
    throw Error(ErrorKind::file, path.string(),
                fmt::format("grid \"{}\" does not fit into memory", entry.name));
  }
}

}  // namespace pileus
