#include "vdb_io/vdb_directory.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <set>
#include <string_view>

#include "lib/core/error.h"
#include "vdb_io/file_cursor.h"
#include "vdb_io/vdb_transform.h"

namespace pileus {
namespace {

constexpr uint64_t kMagic = 0x56444220;  // "VDB " as a 64-bit little-endian number
constexpr uint32_t kOldestVersion = 222, kNewestVersion = 224;
constexpr char kNameSeparator = '\x1e';  // stands between a repeated grid name and its number
constexpr uint64_t kBloscPadding = 128;  // OpenVDB pads smaller tables up to this before it packs them
// More than any program writes, and little enough to hold.
constexpr uint32_t kLongestName = 1 << 12;   // bytes
constexpr uint32_t kLongestText = 1 << 24;   // bytes of a metadata text
constexpr uint32_t kMostMetadata = 1 << 16;  // entries of the file or of a grid
constexpr int32_t kMostGrids = 1 << 16;
constexpr std::string_view kHalfSuffix = "_HalfFloat";

/// Files that are not OpenVDB at all, told apart by their first bytes.
void check_magic(FileCursor& file) {
  if (file.size() == 0) file.fail("is empty (0 bytes); expected an OpenVDB file; fetch it again");
  std::string head(std::min<uint64_t>(file.size(), 64), '\0');
  file.read(head.data(), head.size(), "the first bytes");
  file.enter(0, file.size());
  if (head.starts_with("version https://git-lfs")) {
    file.fail("is a Git LFS pointer, not the OpenVDB file itself; run `git lfs pull` in its repository");
  }
  if (head.starts_with("NanoVDB")) file.fail("is a NanoVDB file; expected OpenVDB; name it .nvdb");
  if (file.size() < sizeof kMagic || file.get<uint64_t>("the magic number") != kMagic) {
    file.fail("does not start as an OpenVDB file does (\"VDB \"); expected a .vdb file");
  }
}

void read_header(FileCursor& file, VdbDirectory& directory) {
  check_magic(file);
  directory.file_version = file.get<uint32_t>("the file version");
  if (directory.file_version < kOldestVersion || directory.file_version > kNewestVersion) {
    file.fail(fmt::format("has OpenVDB file version {}; expected {} to {}; {}", directory.file_version,
                          kOldestVersion, kNewestVersion,
                          directory.file_version > kNewestVersion
                              ? "the file is damaged, or newer than this program"
                              : "write it again with a current OpenVDB (`vdb_tool -read IN -write OUT`)"));
  }
  directory.library_major = file.get<uint32_t>("the library version");
  directory.library_minor = file.get<uint32_t>("the library version");
  if (file.get<char>("the offsets flag") == 0) {
    file.fail("is a stream without grid offsets; write it again as a file (`vdb_tool -read IN -write OUT`)");
  }
  std::array<char, 36> uuid;
  file.read(uuid.data(), uuid.size(), "the file's id");
  for (size_t i = 0; i < uuid.size(); ++i) {
    const bool is_dash_place = i == 8 || i == 13 || i == 18 || i == 23;
    const auto c = static_cast<unsigned char>(uuid[i]);
    if (is_dash_place ? c != '-' : std::isxdigit(c) == 0) file.fail("is damaged: its id is no UUID");
  }
}

template <class T>
std::string get_numbers(FileCursor& file, size_t count) {
  std::string text;
  for (size_t i = 0; i < count; ++i) {
    text += fmt::format("{}{}", i > 0 ? " " : "", file.get<T>("a metadata value"));
  }
  return text;
}

/// The leaf table that lets OpenVDB seek inside a grid. Its decoder trusts three lengths; they are checked
/// here.
void check_delayed_load_table(FileCursor& file, uint64_t end, uint64_t file_bytes) {
  if (end == file.position()) return;
  const auto count = file.get<uint32_t>("the leaf table");
  if (count > file_bytes / 64) file.fail(fmt::format("is damaged: a leaf table of {} leaves", count));
  for (const uint32_t entry_bytes : {1u, 8u}) {  // a mask byte per leaf, then its compressed size
    const auto packed = file.get<uint32_t>("the leaf table");
    if (packed == 0xffffffffu && entry_bytes == 8) continue;  // no sizes stored
    if (packed == 0) {
      file.skip(uint64_t(count) * entry_bytes, "the leaf table");
      continue;
    }
    const uint64_t begin = file.position();
    if (packed < 16) file.fail("is damaged: a compressed leaf table shorter than its own header");
    file.skip(4, "the leaf table");
    const auto unpacked_bytes = file.get<uint32_t>("the leaf table");
    file.skip(4, "the leaf table");
    const auto packed_bytes = file.get<uint32_t>("the leaf table");
    if (unpacked_bytes > std::max<uint64_t>(uint64_t(count) * entry_bytes, kBloscPadding) ||
        packed_bytes != packed) {
      file.fail("is damaged: the sizes in a compressed leaf table disagree");
    }
    file.skip(begin + packed - file.position(), "the leaf table");
  }
  if (file.position() > end) file.fail("is damaged: a leaf table is longer than its entry");
}

std::string read_metadata_value(FileCursor& file, const std::string& type, uint64_t bytes) {
  const auto value_of = [&](std::string_view name, size_t size) { return type == name && bytes == size; };
  if (value_of("bool", 1)) return file.get<char>("a metadata value") != 0 ? "true" : "false";
  if (value_of("int32", 4)) return get_numbers<int32_t>(file, 1);
  if (value_of("int64", 8)) return get_numbers<int64_t>(file, 1);
  if (value_of("float", 4)) return get_numbers<float>(file, 1);
  if (value_of("double", 8)) return get_numbers<double>(file, 1);
  if (value_of("vec3i", 12)) return get_numbers<int32_t>(file, 3);
  if (value_of("vec3s", 12)) return get_numbers<float>(file, 3);
  if (value_of("vec3d", 24)) return get_numbers<double>(file, 3);
  if (type == "string") {
    if (bytes > kLongestText) file.fail(fmt::format("is damaged: a metadata text of {} bytes", bytes));
    std::string text(bytes, '\0');
    file.read(text.data(), bytes, "a metadata text");
    return text;
  }
  return "<" + type + ">";
}

VdbMetadata read_metadata(FileCursor& file) {
  VdbMetadata metadata;
  const auto count = file.get<uint32_t>("the number of metadata entries");
  if (count > kMostMetadata) {
    file.fail(
        fmt::format("is damaged: it claims {} metadata entries; expected at most {}", count, kMostMetadata));
  }
  for (uint32_t i = 0; i < count; ++i) {
    const std::string name = file.get_string("a metadata name", kLongestName);
    const std::string type = file.get_string("a metadata type", kLongestName);
    const auto bytes = file.get<uint32_t>("the size of a metadata value");
    const uint64_t begin = file.position();
    file.skip(bytes, "a metadata value");
    const uint64_t end = file.position();

    // OpenVDB reads fixed-size types by their own size, whatever the entry claims: both must agree.
    static const std::map<std::string, uint32_t> kFixedSizes{
        {"bool", 1},   {"int32", 4},  {"int64", 8},  {"float", 4},  {"double", 8}, {"vec2i", 8},
        {"vec2s", 8},  {"vec2d", 16}, {"vec3i", 12}, {"vec3s", 12}, {"vec3d", 24}, {"vec4i", 16},
        {"vec4s", 16}, {"vec4d", 32}, {"mat4s", 64}, {"mat4d", 128}};
    const auto fixed = kFixedSizes.find(type);
    if (fixed != kFixedSizes.end() && fixed->second != bytes) {
      file.fail(fmt::format("is damaged: metadata \"{}\" of type {} has {} bytes; expected {}", name, type,
                            bytes, fixed->second));
    }
    file.enter(begin, end);
    if (type == "__delayedload") {
      check_delayed_load_table(file, end, file.size());
    } else {
      metadata[name] = read_metadata_value(file, type, bytes);
    }
    file.enter(end, file.size());
  }
  return metadata;
}

/// "name\x1e1" → "name[1]"
std::string readable_name(const std::string& unique_name) {
  const size_t separator = unique_name.find(kNameSeparator);
  if (separator == std::string::npos) return unique_name;
  return unique_name.substr(0, separator) + "[" + unique_name.substr(separator + 1) + "]";
}

/// "Tree_float_5_4_3" → "float"
std::string value_type_of(const std::string& tree_type) {
  std::string type = tree_type;
  if (type.starts_with("Tree_")) type.erase(0, 5);
  if (type.ends_with("_5_4_3")) type.resize(type.size() - 6);
  return type.starts_with("ptdataidx") ? "points" : type;
}

/// A text that messages and tables will show: control characters in it would reach the terminal.
std::string get_printable(FileCursor& file, const char* what) {
  std::string text = file.get_string(what, kLongestName);
  const auto is_bad = [](char c) {
    return std::iscntrl(static_cast<unsigned char>(c)) && c != kNameSeparator;
  };
  if (std::any_of(text.begin(), text.end(), is_bad)) {
    file.fail(fmt::format("is damaged: {} holds control characters", what));
  }
  return text;
}

std::string grid_class_of(const VdbMetadata& metadata) {
  const auto found = metadata.find("class");
  const bool is_known =
      found != metadata.end() &&
      (found->second == "fog volume" || found->second == "level set" || found->second == "staggered");
  return is_known ? found->second : "unknown";
}

VdbGridEntry read_entry(FileCursor& file) {
  VdbGridEntry grid;
  const std::string unique_name = get_printable(file, "a grid's name");
  grid.name = readable_name(unique_name);
  grid.base_name = unique_name.substr(0, unique_name.find(kNameSeparator));
  grid.tree_type = get_printable(file, "a grid's type");
  if (grid.tree_type.ends_with(kHalfSuffix)) {
    grid.saved_as_half = true;
    grid.tree_type.resize(grid.tree_type.size() - kHalfSuffix.size());
  }
  grid.value_type = value_type_of(grid.tree_type);
  grid.shares_tree_with = readable_name(get_printable(file, "a grid's parent"));

  const auto begin = file.get<uint64_t>("a grid's offset");
  grid.blocks_begin = file.get<uint64_t>("a grid's offset");
  grid.end = file.get<uint64_t>("a grid's offset");
  const bool has_voxels = grid.shares_tree_with.empty();
  if (begin != file.position() || grid.end < begin || grid.end > file.size() ||
      (has_voxels && (grid.blocks_begin < begin || grid.blocks_begin > grid.end))) {
    file.fail(
        fmt::format("is damaged or cut short: grid \"{}\" should lie at bytes {} to {}, the file has {}; "
                    "fetch the file again",
                    grid.name, begin, grid.end, file.size()));
  }

  grid.compression = file.get<uint32_t>("a grid's compression");
  if (grid.compression > 7) file.fail(fmt::format("is damaged: compression {:#x}", grid.compression));
  grid.metadata = read_metadata(file);
  grid.grid_class = grid_class_of(grid.metadata);
  grid.map_type = get_printable(file, "a grid's transform");
  return grid;
}

}  // namespace

bool VdbGridEntry::has_affine_map() const {
  return map_bytes(map_type) > 0;
}

bool VdbGridEntry::is_scalar() const {
  static const std::set<std::string> kScalars{"float", "double", "int32", "int64", "bool"};
  return kScalars.contains(value_type);
}

VdbDirectory read_vdb_directory(const std::filesystem::path& path) {
  FileCursor file(path);
  VdbDirectory directory;
  directory.file_bytes = file.size();
  read_header(file, directory);
  directory.format = fmt::format("OpenVDB file version {} (library {}.{})", directory.file_version,
                                 directory.library_major, directory.library_minor);
  directory.metadata = read_metadata(file);

  const auto count = file.get<int32_t>("the number of grids");
  if (count < 0 || count > kMostGrids ||
      uint64_t(count) > file.remaining() / 40) {  // 40 bytes: the least a directory entry takes
    file.fail(fmt::format("is damaged: it claims {} grids in {} bytes", count, file.size()));
  }
  std::set<std::string> names;
  for (int32_t i = 0; i < count; ++i) {
    VdbGridEntry grid = read_entry(file);
    if (!names.insert(grid.name).second) {
      file.fail(fmt::format("is damaged: two grids are called \"{}\"", grid.name));
    }
    grid.topology_begin = file.position() + map_bytes(grid.map_type);
    if (grid.topology_begin > (grid.shares_tree_with.empty() ? grid.blocks_begin : grid.end))
      file.fail(fmt::format("is damaged: grid \"{}\" has no room", grid.name));
    file.enter(grid.end, file.size());
    directory.grids.push_back(std::move(grid));
  }
  return directory;
}

std::string compression_text(uint32_t flags) {
  std::string text;
  const auto append = [&](uint32_t flag, const char* name) {
    if ((flags & flag) != 0) text += (text.empty() ? "" : " + ") + std::string(name);
  };
  append(1, "zip");
  append(4, "blosc");
  append(2, "active mask");
  return text.empty() ? "none" : text;
}

std::string describe(const VdbGridEntry& grid) {
  return fmt::format("{} ({}, {})", grid.name, grid.value_type,
                     grid.grid_class == "unknown" ? "unknown class" : grid.grid_class);
}

}  // namespace pileus
