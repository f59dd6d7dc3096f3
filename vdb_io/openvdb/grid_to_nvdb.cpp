#include <algorithm>
#include <cstring>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include <nanovdb/util/GridStats.h>

#include "lib/core/error.h"
#include "vdb_io/nvdb/nvdb_checksum.h"
#include "vdb_io/nvdb/nvdb_layout.h"
#include "vdb_io/openvdb/nvdb_grids.h"
#include "vdb_io/openvdb/openvdb_library.h"

namespace pileus {
namespace {

using nanovdb::GridBlindMetaData;
using nanovdb::GridData;
using nanovdb::TreeData;

/// What NanoVDB calls an OpenVDB value type, and its number in files.
template <class Value>
struct NanoType;
template <>
struct NanoType<float> {
  using Build = float;
  static constexpr auto kNumber = nanovdb::GridType::Float;
};
template <>
struct NanoType<double> {
  using Build = double;
  static constexpr auto kNumber = nanovdb::GridType::Double;
};
template <>
struct NanoType<int32_t> {
  using Build = int32_t;
  static constexpr auto kNumber = nanovdb::GridType::Int32;
};
template <>
struct NanoType<bool> {
  using Build = bool;
  static constexpr auto kNumber = nanovdb::GridType::Boolean;
};
template <>
struct NanoType<openvdb::Vec3s> {
  using Build = nanovdb::Vec3f;
  static constexpr auto kNumber = nanovdb::GridType::Vec3f;
};

/// Copies a value bit for bit between types of the same layout.
template <class To, class From>
void copy_bits(To& to, const From& from) {
  static_assert(sizeof to == sizeof from);
  std::memcpy(static_cast<void*>(&to), static_cast<const void*>(&from), sizeof to);
}

nanovdb::GridClass class_of(openvdb::GridClass grid_class) {
  switch (grid_class) {
    case openvdb::GRID_LEVEL_SET:
      return nanovdb::GridClass::LevelSet;
    case openvdb::GRID_FOG_VOLUME:
      return nanovdb::GridClass::FogVolume;
    case openvdb::GRID_STAGGERED:
      return nanovdb::GridClass::Staggered;
    default:
      return nanovdb::GridClass::Unknown;
  }
}

/// Lays a grid out as NanoVDB does: head, tree, root with its table, then each level of nodes in the order of
/// the tree, then a name too long for the head.
template <class OpenGrid>
class ImageWriter {
  using Type = NanoType<typename OpenGrid::ValueType>;
  using Build = typename Type::Build;
  using OpenUpper = typename OpenGrid::TreeType::RootNodeType::ChildNodeType;
  using OpenLower = typename OpenUpper::ChildNodeType;
  using OpenLeaf = typename OpenLower::ChildNodeType;
  using Root = typename nanovdb::NanoRoot<Build>::DataType;
  using Upper = typename nanovdb::NanoUpper<Build>::DataType;
  using Lower = typename nanovdb::NanoLower<Build>::DataType;
  using Leaf = typename nanovdb::NanoLeaf<Build>::DataType;

 public:
  explicit ImageWriter(const OpenGrid& grid) : m_grid(grid) { lay_out(); }

  NvdbBuffer write() {
    NvdbBuffer buffer(m_end);
    m_data = buffer.data();
    write_head();
    write_tree();
    write_root();
    write_internal<Upper, OpenUpper>(m_nodes.upper, m_uppers, m_nodes.lower);
    write_internal<Lower, OpenLower>(m_nodes.lower, m_lowers, m_nodes.leaves);
    for (size_t i = 0; i < m_leaves.size(); ++i) write_leaf(at<Leaf>(m_nodes.leaves[i]), *m_leaves[i]);
    if (has_long_name()) write_long_name();
    nanovdb::gridStats(at<nanovdb::NanoGrid<Build>>(0), nanovdb::StatsMode::All);
    give_inactive_nodes_their_place();
    at<GridData>(0).mChecksum = nvdb_checksum(buffer, m_nodes);
    return buffer;
  }

 private:
  template <class T>
  T& at(uint64_t offset) {
    return *reinterpret_cast<T*>(m_data + offset);
  }

  bool has_long_name() const { return m_grid.getName().size() >= size_t(GridData::MaxNameSize); }

  void lay_out() {
    constexpr uint64_t kAlignment = NANOVDB_DATA_ALIGNMENT;
    m_grid.tree().getNodes(m_uppers);
    m_grid.tree().getNodes(m_lowers);
    m_grid.tree().getNodes(m_leaves);
    m_end = kRoot + sizeof(Root) + m_grid.tree().root().getTableSize() * sizeof(typename Root::Tile);
    m_nodes.head_bytes = m_end;
    m_nodes.upper_bytes = sizeof(Upper);
    m_nodes.lower_bytes = sizeof(Lower);
    m_nodes.leaf_bytes = sizeof(Leaf);
    const auto place = [&](std::vector<uint64_t>& offsets, size_t count, uint64_t bytes) {
      for (size_t i = 0; i < count; ++i, m_end += bytes) offsets.push_back(m_end);
    };
    place(m_nodes.upper, m_uppers.size(), sizeof(Upper));
    place(m_nodes.lower, m_lowers.size(), sizeof(Lower));
    place(m_nodes.leaves, m_leaves.size(), sizeof(Leaf));
    m_name = m_end;
    if (!has_long_name()) return;
    m_end += sizeof(GridBlindMetaData) + m_grid.getName().size() + 1;
    m_end = (m_end + kAlignment - 1) / kAlignment * kAlignment;
  }

  void write_head() {
    auto& head = at<GridData>(0);
    head.mMagic = kNvdbMagic;
    head.mVersion = nanovdb::Version();
    head.setBreadthFirstOn();
    head.setLongGridNameOn(has_long_name());
    head.mGridCount = 1;
    head.mGridSize = m_end;
    const std::string name = m_grid.getName();
    std::memcpy(head.mGridName, name.data(), std::min<size_t>(name.size(), GridData::MaxNameSize - 1));
    const openvdb::Mat4R matrix = m_grid.transform().baseMap()->getAffineMap()->getMat4();
    head.mMap.set(matrix, matrix.inverse(), 1.0);
    head.mWorldBBox = nanovdb::BBox<nanovdb::Vec3R>();
    const openvdb::Vec3d voxel = m_grid.voxelSize();
    head.mVoxelSize = nanovdb::Vec3R(voxel.x(), voxel.y(), voxel.z());
    head.mGridClass = class_of(m_grid.getGridClass());
    head.mGridType = Type::kNumber;
  }

  void write_tree() {
    auto& tree = at<TreeData<3>>(kTree);
    const auto first = [](const std::vector<uint64_t>& offsets) {
      return offsets.empty() ? 0 : offsets.front() - kTree;
    };
    tree.mNodeOffset[0] = first(m_nodes.leaves);
    tree.mNodeOffset[1] = first(m_nodes.lower);
    tree.mNodeOffset[2] = first(m_nodes.upper);
    tree.mNodeOffset[3] = kRoot - kTree;
    tree.mNodeCount[0] = uint32_t(m_leaves.size());
    tree.mNodeCount[1] = uint32_t(m_lowers.size());
    tree.mNodeCount[2] = uint32_t(m_uppers.size());
    for (const OpenLower* node : m_lowers) tree.mTileCount[0] += node->getValueMask().countOn();
    for (const OpenUpper* node : m_uppers) tree.mTileCount[1] += node->getValueMask().countOn();
    for (auto tile = m_grid.tree().root().cbeginValueOn(); tile; ++tile) ++tree.mTileCount[2];
    tree.mVoxelCount = m_grid.activeVoxelCount();
  }

  void write_root() {
    auto& root = at<Root>(kRoot);
    copy_bits(root.mBackground, m_grid.background());
    size_t child = 0;
    const auto& source = m_grid.tree().root();
    for (auto entry = source.cbeginChildAll(); entry; ++entry) {
      auto& tile =
          at<typename Root::Tile>(kRoot + sizeof(Root) + root.mTableSize++ * sizeof(typename Root::Tile));
      const openvdb::Coord origin = entry.getCoord();
      tile.key = Root::CoordToKey(nanovdb::Coord(origin.x(), origin.y(), origin.z()));
      typename OpenGrid::ValueType value{};
      if (entry.probeChild(value)) {
        tile.child = int64_t(m_nodes.upper[child++] - kRoot);
      } else {
        tile.state = entry.isValueOn() ? 1 : 0;
        copy_bits(tile.value, value);
      }
    }
  }

  template <class Node, class OpenNode>
  void write_internal(const std::vector<uint64_t>& offsets, const std::vector<const OpenNode*>& sources,
                      const std::vector<uint64_t>& children) {
    size_t child = 0;
    for (size_t i = 0; i < sources.size(); ++i) {
      const OpenNode& source = *sources[i];
      auto& node = at<Node>(offsets[i]);
      set_origin(node.mBBox[0], source.origin());
      copy_bits(node.mValueMask, source.getValueMask());
      copy_bits(node.mChildMask, source.getChildMask());
      for (uint32_t n = 0; n < OpenNode::NUM_VALUES; ++n) {
        if (source.isChildMaskOn(n)) {
          node.mTable[n].child = int64_t(children[child++] - offsets[i]);
        } else {
          copy_bits(node.mTable[n].value, source.getTable()[n].getValue());
        }
      }
    }
  }

  void write_leaf(Leaf& leaf, const OpenLeaf& source) {
    set_origin(leaf.mBBoxMin, source.origin());
    copy_bits(leaf.mValueMask, source.getValueMask());
    if constexpr (std::is_same_v<Build, bool>) {
      for (uint32_t n = 0; n < OpenLeaf::SIZE; ++n) leaf.mValues.set(n, source.getValue(n));
    } else {
      std::memcpy(static_cast<void*>(leaf.mValues), static_cast<const void*>(source.buffer().data()),
                  sizeof leaf.mValues);
    }
  }

  static void set_origin(nanovdb::Coord& target, const openvdb::Coord& origin) {
    target = nanovdb::Coord(origin.x(), origin.y(), origin.z());
  }

  void write_long_name() {
    auto& head = at<GridData>(0);
    head.mBlindMetadataOffset = int64_t(m_name);
    head.mBlindMetadataCount = 1;
    auto& blind = at<GridBlindMetaData>(m_name);
    const std::string name = m_grid.getName();
    blind.mByteOffset = sizeof(GridBlindMetaData);
    blind.mElementCount = name.size() + 1;
    blind.mDataClass = nanovdb::GridBlindDataClass::GridName;
    std::memcpy(m_data + m_name + sizeof blind, name.c_str(), name.size() + 1);
  }

  /// A node without active voxels has an empty box: NanoVDB's statistics leave it without the corner that
  /// tells the node's place.
  void give_inactive_nodes_their_place() {
    const auto repair = [&](auto& node, const openvdb::Coord& origin) {
      if (!node.mBBox.empty()) return;
      set_origin(node.mBBox[0], origin);
      set_origin(node.mBBox[1], origin.offsetBy(-1));
    };
    for (size_t i = 0; i < m_uppers.size(); ++i) repair(at<Upper>(m_nodes.upper[i]), m_uppers[i]->origin());
    for (size_t i = 0; i < m_lowers.size(); ++i) repair(at<Lower>(m_nodes.lower[i]), m_lowers[i]->origin());
  }

  static constexpr uint64_t kTree = sizeof(GridData), kRoot = kTree + sizeof(TreeData<3>);

  const OpenGrid& m_grid;
  std::vector<const OpenUpper*> m_uppers;
  std::vector<const OpenLower*> m_lowers;
  std::vector<const OpenLeaf*> m_leaves;
  NvdbNodes m_nodes;
  uint64_t m_name = 0, m_end = 0;
  std::byte* m_data = nullptr;
};

template <class OpenGrid>
bool written_as(const openvdb::GridBase& grid, std::optional<NvdbBuffer>& buffer) {
  if (!grid.isType<OpenGrid>()) return false;
  buffer = ImageWriter<OpenGrid>(static_cast<const OpenGrid&>(grid)).write();
  return true;
}

}  // namespace

NvdbBuffer nvdb_from_grid(const std::filesystem::path& path, const openvdb::GridBase& grid) {
  initialize_openvdb();
  if (!grid.transform().isLinear()) {
    throw Error(ErrorKind::file, path.string(),
                fmt::format("grid \"{}\" has the transform {}; NanoVDB knows affine ones only",
                            grid.getName(), grid.transform().mapType()));
  }
  std::optional<NvdbBuffer> buffer;
  const bool is_written =
      written_as<openvdb::FloatGrid>(grid, buffer) || written_as<openvdb::DoubleGrid>(grid, buffer) ||
      written_as<openvdb::Int32Grid>(grid, buffer) || written_as<openvdb::BoolGrid>(grid, buffer) ||
      written_as<openvdb::Vec3SGrid>(grid, buffer);
  if (!is_written) {
    throw Error(ErrorKind::file, path.string(),
                fmt::format("grid \"{}\" holds values of type {}, which .nvdb files of pileus do not",
                            grid.getName(), grid.valueType()));
  }
  return *std::move(buffer);
}

}  // namespace pileus
