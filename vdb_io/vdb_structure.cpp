#include "vdb_io/vdb_structure.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <map>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "vdb_io/file_cursor.h"
#include "vdb_io/tree_layout.h"
#include "vdb_io/value_coding.h"

namespace pileus {
namespace {

constexpr uint64_t kNodeOverhead = 128;  // bytes: a node's own members, and what malloc adds

/// First and last bit that is set; `bits` is not 0.
struct BitRange {
  int first, last;
  explicit BitRange(uint64_t bits) : first(std::countr_zero(bits)), last(63 - std::countl_zero(bits)) {}
};

/// Box of a leaf's active voxels, seen from its origin; `mask` is not empty. A word is a layer along x, a
/// byte of it a row along y: no voxel is looked at by itself.
Imath::Box3i box_of(const LeafMask& mask) {
  uint64_t layers = 0, any_layer = 0;
  for (int x = 0; x < LeafMask::kWords; ++x) {
    layers |= uint64_t(mask.words[size_t(x)] != 0) << x;
    any_layer |= mask.words[size_t(x)];
  }
  uint64_t any_row = any_layer | any_layer >> 32;
  any_row |= any_row >> 16;
  any_row |= any_row >> 8;
  const BitRange x(layers), y(any_layer), z(any_row & 0xff);
  return {{x.first, y.first / 8, z.first}, {x.last, y.last / 8, z.last}};
}

struct ValueSize {
  uint32_t bytes;       ///< of a value in memory
  uint32_t half_bytes;  ///< of a value saved as half; 0 for whole numbers, which are never halved
};

class StructureWalk {
 public:
  StructureWalk(FileCursor& file, const VdbGridEntry& grid, ValueSize size)
      : m_file(file),
        m_grid(grid),
        m_value_bytes(size.bytes),
        m_is_half(grid.saved_as_half && size.half_bytes > 0),
        m_stored_bytes(m_is_half ? size.half_bytes : size.bytes) {}

  TreeLayout run() {
    check_half_flags();
    m_file.enter(m_grid.topology_begin, m_grid.blocks_begin);
    read_root();
    if (m_file.remaining() != 0) damaged("bytes are left over after the tree");
    m_file.enter(m_grid.blocks_begin, m_grid.end);
    for (LeafLayout& leaf : m_layout.leaves) read_leaf_block(leaf);
    if (m_file.remaining() != 0) damaged("bytes are left over after the voxels");
    return std::move(m_layout);
  }

 private:
  [[noreturn]] void damaged(std::string_view what) const {
    m_file.fail(fmt::format("is damaged: grid \"{}\": {} (near byte {}); fetch the file again", m_grid.name,
                            what, m_file.position()));
  }

  /// The file says twice whether values are halved: in the name of the type, and in the metadata, which
  /// OpenVDB goes by.
  void check_half_flags() const {
    const auto flag = m_grid.metadata.find("is_saved_as_half_float");
    const bool is_half = flag != m_grid.metadata.end() && flag->second == "true";
    if (is_half != m_grid.saved_as_half) damaged("its type and its metadata disagree about half floats");
  }

  Vec3i get_root_origin(int tile_size) {
    Vec3i origin;
    m_file.read(&origin, sizeof origin, "a node's origin");
    // The largest few coordinates are left out so that a neighbouring voxel's index cannot overflow.
    constexpr int kLimit = std::numeric_limits<int>::max() / 2;
    for (int axis = 0; axis < 3; ++axis) {
      if (origin[axis] % tile_size != 0) damaged("a node lies off the raster of its level");
      if (origin[axis] < -kLimit || origin[axis] > kLimit) damaged("a node lies too far out");
    }
    return origin;
  }

  void read_root() {
    constexpr int kUpperSize = 4096;
    if (m_file.get<uint32_t>("the number of buffers") != 1) damaged("a tree has other than one buffer");
    m_layout.background = m_file.position();
    m_file.skip(m_value_bytes, "the background");
    const auto tiles = m_file.get<uint32_t>("the number of root tiles");
    const auto children = m_file.get<uint32_t>("the number of root nodes");
    for (uint32_t i = 0; i < tiles; ++i) {
      const Vec3i origin = get_root_origin(kUpperSize);
      const uint64_t value = m_file.position();
      m_file.skip(m_value_bytes, "a root tile");
      const auto active = m_file.get<uint8_t>("a root tile");
      if (active > 1) damaged("a root tile is neither active nor inactive");
      if (active == 1) add_active_tile(origin, kUpperSize);
      m_layout.root_tiles.push_back({origin, active == 1, value});
    }
    const auto key = [](const Vec3i& p) { return std::tuple(p.x, p.y, p.z); };
    std::vector<std::tuple<int, int, int>> taken;
    for (const RootTileLayout& tile : m_layout.root_tiles) taken.push_back(key(tile.origin));
    for (uint32_t i = 0; i < children; ++i) {
      const Vec3i origin = get_root_origin(kUpperSize);
      if (i > 0 && key(origin) <= taken.back()) damaged("root nodes are out of order");
      taken.push_back(key(origin));
      read_internal<5, 128>(origin);
    }
    std::sort(taken.begin(), taken.end());
    if (std::adjacent_find(taken.begin(), taken.end()) != taken.end())
      damaged("a root tile lies where another one or a node does");
  }

  template <int kLog2Dim, int kChildSize>
  void read_internal(const Vec3i& origin) {
    ++m_structure.internal_nodes;
    constexpr uint64_t kEntries = uint64_t(1)
                                  << (3 * kLog2Dim);  // each a value or a pointer, beside two masks
    m_structure.memory_bytes +=
        kEntries * std::max<uint64_t>(m_value_bytes, sizeof(void*)) + kEntries / 4 + kNodeOverhead;
    NodeMask<kLog2Dim> children, active;
    m_file.read(&children, sizeof children, "a node's child mask");
    m_file.read(&active, sizeof active, "a node's value mask");
    for (int w = 0; w < children.kWords; ++w) {
      if ((children.words[size_t(w)] & active.words[size_t(w)]) != 0)
        damaged("a voxel is both tile and node");
    }
    const ValueBlock values = skip_values(sizeof active, uint32_t(8 * sizeof active), active.count());
    m_layout.nodes.push_back({origin,
                              kChildSize,
                              {children.words.begin(), children.words.end()},
                              {active.words.begin(), active.words.end()},
                              values});
    const auto corner = [&](int x, int y, int z) { return origin + Vec3i(x, y, z) * kChildSize; };
    active.for_each([&](int x, int y, int z) { add_active_tile(corner(x, y, z), kChildSize); });
    children.for_each([&](int x, int y, int z) {
      if constexpr (kChildSize == 8) {
        read_leaf_mask(corner(x, y, z));
      } else {
        read_internal<kLog2Dim - 1, 8>(corner(x, y, z));
      }
    });
  }

  void read_leaf_mask(const Vec3i& origin) {
    LeafMask active;
    m_file.read(&active, sizeof active, "a leaf's mask");
    m_layout.leaves.push_back({origin, active, {}});
    ++m_structure.leaves;
    m_structure.memory_bytes += leaf_bytes();
    const uint32_t count = active.count();
    m_structure.active_voxels += count;
    if (count == 0) return;
    const Imath::Box3i box = box_of(active);
    m_structure.active_bounds.extendBy(origin + box.min);
    m_structure.active_bounds.extendBy(origin + box.max);
  }

  /// The mask here is that of the tree again, which OpenVDB skips, too.
  void read_leaf_block(LeafLayout& leaf) {
    m_file.skip(sizeof(LeafMask), "a leaf's mask");
    if (m_grid.value_type == "bool") {  // bits instead of values, with an origin of their own
      Vec3i origin;
      m_file.read(&origin, sizeof origin, "a leaf's origin");
      if (origin != leaf.origin) damaged("a leaf does not lie where its tree says");
      leaf.values.begin = m_file.position();
      m_file.skip(sizeof(LeafMask), "a leaf's voxels");
      leaf.values.end = m_file.position();
    } else {
      leaf.values = skip_values(sizeof(LeafMask), 512, leaf.active.count());
    }
  }

  uint64_t leaf_bytes() const {
    constexpr uint64_t kVoxels = 512;
    const uint64_t values = m_grid.value_type == "bool" ? kVoxels / 8 : kVoxels * m_value_bytes;
    return values + sizeof(LeafMask) + kNodeOverhead;
  }

  /// A node's values: how inactive ones look, then the block itself.
  ValueBlock skip_values(uint64_t mask_bytes, uint32_t count, uint32_t active) {
    const uint64_t begin = m_file.position();
    const auto inactive = InactiveValues(m_file.get<uint8_t>("a node's flags"));
    if (inactive > InactiveValues::all_stored) damaged("unknown flags of a node");
    m_file.skip(uint64_t(stored_inactive_values(inactive)) * m_value_bytes, "an inactive value");
    if (has_inactive_mask(inactive)) m_file.skip(mask_bytes, "a mask of inactive values");
    skip_block(has_only_active_values(inactive, m_grid.compression) ? active : count);
    return {begin, m_file.position()};
  }

  void skip_block(uint32_t count) {
    const uint64_t unpacked = uint64_t(count) * m_stored_bytes;
    if (m_is_half && count == 0) return;  // as OpenVDB writes it
    if ((m_grid.compression & (kZipped | kBlosc)) == 0) {
      m_file.skip(unpacked, "voxels");
      return;
    }
    const auto packed = m_file.get<int64_t>("the size of a block");
    if (packed <= 0) {
      if (packed != -int64_t(unpacked)) damaged("an unpacked block does not have the size of its node");
      m_file.skip(unpacked, "voxels");
      return;
    }
    const uint64_t begin = m_file.position();
    if ((m_grid.compression & kBlosc) != 0) check_blosc_header(uint64_t(packed), unpacked);
    m_file.skip(uint64_t(packed) - (m_file.position() - begin), "packed voxels");
  }

  /// Blosc is handed no length of its input: it believes the header.
  void check_blosc_header(uint64_t packed, uint64_t unpacked) {
    if (packed < 16) damaged("a blosc block shorter than its own header");
    m_file.skip(4, "a blosc header");
    const auto header_unpacked = m_file.get<uint32_t>("a blosc header");
    m_file.skip(4, "a blosc header");
    const auto header_packed = m_file.get<uint32_t>("a blosc header");
    if (header_unpacked != unpacked || header_packed != packed)
      damaged("the sizes of a blosc block disagree");
  }

  void add_active_tile(const Vec3i& origin, int size) {
    ++m_structure.active_tiles;
    m_structure.active_voxels += uint64_t(size) * uint64_t(size) * uint64_t(size);
    m_structure.active_bounds.extendBy(origin);
    m_structure.active_bounds.extendBy(origin + Vec3i(size - 1));
  }

  FileCursor& m_file;
  const VdbGridEntry& m_grid;
  uint32_t m_value_bytes;   ///< in memory, and wherever a value stands alone
  bool m_is_half;           ///< blocks hold 16-bit floats
  uint32_t m_stored_bytes;  ///< of one value in a block
  TreeLayout m_layout;
  GridStructure& m_structure = m_layout.structure;
};

}  // namespace

std::optional<TreeLayout> read_tree_layout(const std::filesystem::path& path, const VdbGridEntry& grid) {
  static const std::map<std::string, ValueSize> kSizes{
      {"float", {4, 2}}, {"double", {8, 2}}, {"int32", {4, 0}},  {"int64", {8, 0}},
      {"bool", {1, 0}},  {"vec3s", {12, 6}}, {"vec3d", {24, 6}}, {"vec3i", {12, 0}}};
  const auto size = kSizes.find(grid.value_type);
  const bool is_walkable = grid.has_affine_map() && grid.shares_tree_with.empty();
  if (size == kSizes.end() || !is_walkable) return std::nullopt;
  FileCursor file(path);
  return StructureWalk(file, grid, size->second).run();
}

std::optional<GridStructure> check_grid_structure(const std::filesystem::path& path,
                                                  const VdbGridEntry& grid) {
  const std::optional<TreeLayout> layout = read_tree_layout(path, grid);
  return layout ? std::optional(layout->structure) : std::nullopt;
}

}  // namespace pileus
