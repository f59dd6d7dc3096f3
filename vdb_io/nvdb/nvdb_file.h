#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace pileus {

enum class NvdbCodec : uint16_t { none = 0, zip = 1, blosc = 2 };

/// One grid as the file's directory describes it.
struct NvdbGridEntry {
  std::string name;
  uint32_t type = 0;        ///< NanoVDB's number: 1 float, 2 double, 6 vec3s, …
  uint32_t grid_class = 0;  ///< NanoVDB's number: 1 level set, 2 fog volume, …
  uint64_t active_voxels = 0;
  NvdbCodec codec = NvdbCodec::none;
  uint64_t memory_bytes = 0;           ///< unpacked
  uint64_t begin = 0, file_bytes = 0;  ///< where its bytes lie in the file
};

struct NvdbDirectory {
  uint64_t file_bytes = 0;
  uint32_t version_major = 0, version_minor = 0;
  std::vector<NvdbGridEntry> grids;  ///< in the order of the file
};

/// The memory image of a grid: NanoVDB's structures are aligned to 32 bytes, and so is this.
class NvdbBuffer {
 public:
  explicit NvdbBuffer(uint64_t bytes) : m_blocks((bytes + 31) / 32), m_bytes(bytes) {}

  std::byte* data() { return reinterpret_cast<std::byte*>(m_blocks.data()); }
  const std::byte* data() const { return reinterpret_cast<const std::byte*>(m_blocks.data()); }
  uint64_t size() const { return m_bytes; }

 private:
  struct alignas(32) Block {
    std::byte bytes[32]{};
  };
  std::vector<Block> m_blocks;
  uint64_t m_bytes;
};

/// Reads the directory of a NanoVDB file (layout 32, which NanoVDB 10 to 12 write) without unpacking
/// anything. Whatever passes has lengths that lie inside the file, and unpacked sizes that a codec can reach.
/// errors: Error(file) with one line: empty, not NanoVDB, another layout, cut short, …
NvdbDirectory read_nvdb_directory(const std::filesystem::path& path);

/// Reads and unpacks one grid of read_nvdb_directory(path). Its structure is not checked: see nvdb_grids.h.
/// errors: Error(file) where the packed bytes are damaged
NvdbBuffer read_nvdb_buffer(const std::filesystem::path& path, const NvdbGridEntry& entry);

/// "float", "vec3s", … as OpenVDB calls the type; "" for one that pileus does not know.
std::string nvdb_value_type(uint32_t type);

/// "fog volume", "level set", "staggered" or "unknown".
std::string nvdb_class_name(uint32_t grid_class);

/// Writes the memory images to a file as NanoVDB's own tools do; the same grids give the same bytes.
///   buffers: made by nvdb_from_grid
/// errors: Error(file)
void write_nvdb(const std::filesystem::path& path, const std::vector<NvdbBuffer>& buffers, NvdbCodec codec);

}  // namespace pileus
