#include <cmath>
#include <cstring>
#include <limits>
#include <set>
#include <type_traits>

#include "lib/core/error.h"
#include "vdb_io/nvdb/nvdb_checksum.h"
#include "vdb_io/nvdb/nvdb_layout.h"
#include "vdb_io/openvdb/nvdb_grids.h"
#include "vdb_io/openvdb/openvdb_library.h"

namespace pileus {
namespace {

using nanovdb::GridData;
using nanovdb::TreeData;

constexpr uint64_t kMapOffset = 296, kTypeOffset = 636;  ///< in GridData, for messages

/// What OpenVDB calls the value of a NanoVDB build type.
template <class Build>
struct OpenValue {
  using Type = Build;
};
template <class T>
struct OpenValue<nanovdb::Vec3<T>> {
  using Type = openvdb::math::Vec3<T>;
};

/// Looks into a memory image: every access is checked against its size and for alignment.
class Image {
 public:
  Image(const std::filesystem::path& path, const NvdbGridEntry& entry, const NvdbBuffer& buffer)
      : m_path(path), m_entry(entry), m_buffer(buffer) {}

  [[noreturn]] void damaged(const std::string& what, uint64_t offset) const {
    throw Error(ErrorKind::file, m_path.string(),
                fmt::format("is damaged: grid \"{}\": {} (byte {} of {} unpacked ones); fetch the file again",
                            m_entry.name, what, offset, m_buffer.size()));
  }

  template <class T>
  const T& at(uint64_t offset, const char* what) const {
    require(offset, sizeof(T), what);
    return *reinterpret_cast<const T*>(m_buffer.data() + offset);
  }

  void require(uint64_t offset, uint64_t bytes, const char* what) const {
    if (offset % NANOVDB_DATA_ALIGNMENT != 0) damaged(fmt::format("{} is not aligned", what), offset);
    if (offset > m_buffer.size() || bytes > m_buffer.size() - offset) {
      damaged(fmt::format("{} of {} bytes lies outside", what, bytes), offset);
    }
  }

  /// base + step, where that is a place in the image.
  uint64_t moved(uint64_t base, int64_t step, const char* what) const {
    int64_t place = 0;
    if (__builtin_add_overflow(int64_t(base), step, &place) || place < 0) {
      damaged(fmt::format("{} lies outside", what), base);
    }
    return uint64_t(place);
  }

  const NvdbBuffer& buffer() const { return m_buffer; }
  const NvdbGridEntry& entry() const { return m_entry; }

 private:
  const std::filesystem::path& m_path;
  const NvdbGridEntry& m_entry;
  const NvdbBuffer& m_buffer;
};

template <class To, class From>
To same_bits(const From& from) {
  static_assert(sizeof(To) == sizeof(From));
  if constexpr (std::is_same_v<To, bool>) {  // any byte may stand there
    unsigned char byte = 0;
    std::memcpy(&byte, &from, 1);
    return byte != 0;
  }
  To to;
  std::memcpy(static_cast<void*>(&to), static_cast<const void*>(&from), sizeof to);
  return to;
}

/// Walks the tree of one image and builds it anew.
template <class Build>
class TreeReader {
  using Value = typename OpenValue<Build>::Type;
  using OpenTree = typename openvdb::tree::Tree4<Value, 5, 4, 3>::Type;
  using OpenGrid = openvdb::Grid<OpenTree>;
  using OpenUpper = typename OpenTree::RootNodeType::ChildNodeType;
  using OpenLower = typename OpenUpper::ChildNodeType;
  using OpenLeaf = typename OpenLower::ChildNodeType;

  using NanoRoot = typename nanovdb::NanoRoot<Build>::DataType;
  using NanoUpper = typename nanovdb::NanoUpper<Build>::DataType;
  using NanoLower = typename nanovdb::NanoLower<Build>::DataType;
  using NanoLeaf = typename nanovdb::NanoLeaf<Build>::DataType;

 public:
  explicit TreeReader(const Image& image)
      : m_image(image), m_tree(image.at<TreeData<3>>(sizeof(GridData), "the tree")) {
    m_nodes.upper_bytes = sizeof(NanoUpper);
    m_nodes.lower_bytes = sizeof(NanoLower);
    m_nodes.leaf_bytes = sizeof(NanoLeaf);
  }

  openvdb::GridBase::Ptr read() {
    const uint64_t offset = m_image.moved(sizeof(GridData), int64_t(m_tree.mNodeOffset[3]), "the root");
    const auto& root = m_image.at<NanoRoot>(offset, "the root");
    m_background = same_bits<Value>(root.mBackground);
    const auto grid = OpenGrid::create(m_background);
    read_root(root, offset, grid->tree().root());
    const uint32_t found[3] = {uint32_t(m_nodes.leaves.size()), uint32_t(m_nodes.lower.size()),
                               uint32_t(m_nodes.upper.size())};
    for (int level = 0; level < 3; ++level) {
      if (found[level] == m_tree.mNodeCount[level]) continue;
      m_image.damaged(
          fmt::format("{} nodes of level {}, it claims {}", found[level], level, m_tree.mNodeCount[level]),
          sizeof(GridData));
    }
    return grid;
  }

  const NvdbNodes& nodes() const { return m_nodes; }

 private:
  void read_root(const NanoRoot& root, uint64_t offset, typename OpenTree::RootNodeType& target) {
    using Tile = typename NanoRoot::Tile;
    const uint64_t tiles = offset + sizeof(NanoRoot), bytes = uint64_t(root.mTableSize) * sizeof(Tile);
    m_image.require(tiles, bytes, "the root's table");
    m_nodes.head_bytes = sizeof(GridData) + sizeof(TreeData<3>) + sizeof(NanoRoot) + bytes;
    std::set<uint64_t> keys;
    for (uint32_t i = 0; i < root.mTableSize; ++i) {
      const uint64_t at = tiles + i * sizeof(Tile);
      const auto& tile = m_image.at<Tile>(at, "a root tile");
      if (tile.key >> 63 != 0 || !keys.insert(tile.key).second) {
        m_image.damaged("two root nodes at one place", at);
      }
      const openvdb::Coord origin = same_bits<openvdb::Coord>(NanoRoot::KeyToCoord(tile.key));
      check_origin(origin, at);
      if (tile.child == 0) {
        target.addTile(origin, same_bits<Value>(tile.value), tile.state != 0);
        continue;
      }
      auto* child = new OpenUpper(origin, m_background, false);
      target.addChild(child);
      read_internal<NanoUpper>(m_image.moved(offset, tile.child, "an upper node"), *child);
    }
  }

  /// As in .vdb files, the largest few coordinates are left out so that a neighbour's index cannot overflow.
  void check_origin(const openvdb::Coord& origin, uint64_t at) const {
    constexpr int kLimit = std::numeric_limits<int>::max() / 2;
    for (int axis = 0; axis < 3; ++axis) {
      if (origin[axis] < -kLimit || origin[axis] > kLimit) m_image.damaged("a node lies too far out", at);
    }
  }

  /// Notes a node, and refuses to meet more of them than the image claims: no loops, no shared children.
  void note(std::vector<uint64_t>& level, uint32_t claimed, uint64_t offset) {
    if (level.size() >= claimed) {
      m_image.damaged(fmt::format("more nodes than the {} that it claims", claimed), offset);
    }
    level.push_back(offset);
  }

  template <class NanoNode, class OpenNode>
  void read_internal(uint64_t offset, OpenNode& target) {
    constexpr bool kIsUpper = std::is_same_v<NanoNode, NanoUpper>;
    note(kIsUpper ? m_nodes.upper : m_nodes.lower, m_tree.mNodeCount[kIsUpper ? 2 : 1], offset);
    const auto& node = m_image.at<NanoNode>(offset, "an internal node");
    for (uint32_t n = 0; n < OpenNode::NUM_VALUES; ++n) {
      const bool is_on = node.mValueMask.isOn(n);
      if (!node.mChildMask.isOn(n)) {
        target.addTile(n, same_bits<Value>(node.mTable[n].value), is_on);
        continue;
      }
      if (is_on) m_image.damaged("a place is both tile and node", offset);
      const uint64_t at = m_image.moved(offset, node.mTable[n].child, "a node");
      if constexpr (kIsUpper) {
        auto* child = new OpenLower(target.offsetToGlobalCoord(n), m_background, false);
        target.addChild(child);
        read_internal<NanoLower>(at, *child);
      } else {
        auto* child = new OpenLeaf(target.offsetToGlobalCoord(n), m_background, false);
        target.addChild(child);
        read_leaf(at, *child);
      }
    }
  }

  void read_leaf(uint64_t offset, OpenLeaf& target) {
    note(m_nodes.leaves, m_tree.mNodeCount[0], offset);
    if constexpr (std::is_same_v<Build, float>) {
      if (m_image.entry().type != uint32_t(nanovdb::GridType::Float))
        return read_quantized_leaf(offset, target);
    }
    const auto& leaf = m_image.at<NanoLeaf>(offset, "a leaf");
    if constexpr (std::is_same_v<Build, bool>) {
      for (uint32_t n = 0; n < OpenLeaf::SIZE; ++n) target.setValueOnly(n, leaf.mValues.isOn(n));
    } else {
      std::memcpy(static_cast<void*>(target.buffer().data()), static_cast<const void*>(leaf.mValues),
                  sizeof leaf.mValues);
    }
    target.setValueMask(same_bits<openvdb::util::NodeMask<3>>(leaf.mValueMask));
  }

  /// Fp4 to FpN: grids of floats whose leaves hold shares of their range. All other nodes are those of
  /// floats.
  void read_quantized_leaf(uint64_t offset, openvdb::FloatTree::LeafNodeType& target) {
    switch (nanovdb::GridType(m_image.entry().type)) {
      case nanovdb::GridType::Fp4:
        return unpack<nanovdb::Fp4>(offset, target);
      case nanovdb::GridType::Fp8:
        return unpack<nanovdb::Fp8>(offset, target);
      case nanovdb::GridType::Fp16:
        return unpack<nanovdb::Fp16>(offset, target);
      default:
        return unpack<nanovdb::FpN>(offset, target);
    }
  }

  template <class Quantized>
  void unpack(uint64_t offset, openvdb::FloatTree::LeafNodeType& target) {
    using Packed = typename nanovdb::NanoLeaf<Quantized>::DataType;
    const auto& leaf = m_image.at<Packed>(offset, "a leaf");
    m_nodes.leaf_bytes = sizeof(Packed);
    if constexpr (std::is_same_v<Quantized, nanovdb::FpN>) {
      if (leaf.mFlags >> 5 > 4) m_image.damaged("a leaf of unknown width", offset);
      m_image.require(offset, leaf.memUsage(), "a leaf");
    }
    float* values = target.buffer().data();
    for (uint32_t n = 0; n < OpenLeaf::SIZE; ++n) values[n] = leaf.getValue(n);
    target.setValueMask(same_bits<openvdb::util::NodeMask<3>>(leaf.mValueMask));
  }

  const Image& m_image;
  const TreeData<3>& m_tree;
  Value m_background{};
  NvdbNodes m_nodes;
};

openvdb::math::Transform::Ptr transform_of(const Image& image, const GridData& head) {
  openvdb::Mat4R matrix = openvdb::Mat4R::identity();
  bool is_finite = true;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) matrix[j][i] = head.mMap.mMatD[3 * i + j];  // stored transposed
    matrix[3][i] = head.mMap.mVecD[i];
  }
  for (int i = 0; i < 16; ++i) is_finite = is_finite && std::isfinite(matrix.asPointer()[i]);
  try {
    if (is_finite && std::isnormal(matrix.det()))
      return openvdb::math::Transform::createLinearTransform(matrix);
  } catch (const openvdb::Exception&) {
  }
  image.damaged("its transform cannot be inverted", kMapOffset);
}

openvdb::GridClass class_of(nanovdb::GridClass grid_class) {
  switch (grid_class) {
    case nanovdb::GridClass::LevelSet:
      return openvdb::GRID_LEVEL_SET;
    case nanovdb::GridClass::FogVolume:
      return openvdb::GRID_FOG_VOLUME;
    case nanovdb::GridClass::Staggered:
      return openvdb::GRID_STAGGERED;
    default:
      return openvdb::GRID_UNKNOWN;
  }
}

void check_head(const Image& image, const GridData& head) {
  if (head.mMagic != kNvdbMagic && head.mMagic != kNvdbMagicGrid)
    image.damaged("it does not start as a grid", 0);
  if (nvdb_major(head.mVersion.id()) != kNvdbLayout) image.damaged("its layout is not 32", 16);
  if (head.mGridSize != image.buffer().size()) {
    image.damaged(fmt::format("it claims {} bytes", head.mGridSize), 32);
  }
  if (uint32_t(head.mGridType) != image.entry().type) {
    image.damaged(fmt::format("its type is {}, the file's directory says {}", uint32_t(head.mGridType),
                              image.entry().type),
                  kTypeOffset);
  }
}

template <class Build>
openvdb::GridBase::Ptr read_as(const Image& image, const GridData& head) {
  TreeReader<Build> reader(image);
  const openvdb::GridBase::Ptr grid = reader.read();
  const bool has_old_checksum = nvdb_minor(head.mVersion.id()) < 6;
  if (has_old_checksum && !nvdb_checksum_agrees(head.mChecksum, image.buffer(), reader.nodes())) {
    image.damaged("its checksum does not agree with its contents", 8);
  }
  return grid;
}

}  // namespace

openvdb::GridBase::Ptr grid_from_nvdb(const std::filesystem::path& path, const NvdbGridEntry& entry,
                                      const NvdbBuffer& buffer) {
  initialize_openvdb();
  const Image image(path, entry, buffer);
  const auto& head = image.at<GridData>(0, "the grid's head");
  check_head(image, head);
  openvdb::GridBase::Ptr grid;
  switch (head.mGridType) {
    case nanovdb::GridType::Float:
    case nanovdb::GridType::Fp4:
    case nanovdb::GridType::Fp8:
    case nanovdb::GridType::Fp16:
    case nanovdb::GridType::FpN:
      grid = read_as<float>(image, head);
      break;
    case nanovdb::GridType::Double:
      grid = read_as<double>(image, head);
      break;
    case nanovdb::GridType::Int32:
      grid = read_as<int32_t>(image, head);
      break;
    case nanovdb::GridType::Boolean:
      grid = read_as<bool>(image, head);
      break;
    case nanovdb::GridType::Vec3f:
      grid = read_as<nanovdb::Vec3f>(image, head);
      break;
    default:
      throw Error(ErrorKind::file, path.string(),
                  fmt::format("grid \"{}\" holds values of type {}; expected float, double, int32, bool, "
                              "vec3s or Fp4 to FpN",
                              entry.name, nvdb_value_type(entry.type)));
  }
  grid->setName(entry.name);
  grid->setGridClass(class_of(head.mGridClass));
  grid->setTransform(transform_of(image, head));
  return grid;
}

}  // namespace pileus
