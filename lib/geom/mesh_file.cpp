#include "lib/geom/mesh_file.h"

#include <algorithm>
#include <cctype>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "lib/core/error.h"
#include "lib/core/memory_budget.h"
#include "lib/core/own_library.h"
#include "lib/core/run_apart.h"
#include "lib/geom/meshes/meshes.h"

namespace pileus {
namespace {

namespace fs = std::filesystem;

/// What reading takes, for each byte of a file: of an OBJ face of 6 bytes, three corners with all that is
/// kept of each on the way, and a place in the index; and what it takes in any case.
constexpr uint64_t kMemoryPerByte = 100, kLeastMemory = 64 << 20;

/// A hundred times what files in order take.
constexpr double kLeastSeconds = 0.2, kSecondsPerByte = 4e-6;

std::string lower_extension(const fs::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  return extension.empty() ? "" : extension.substr(1);
}

// A mesh as bytes: the numbers of vertices, normals and triangles, and these.

template <class T>
void put(std::string& bytes, const std::vector<T>& values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

std::string to_bytes(const MeshData& mesh) {
  const std::vector<uint64_t> counts{mesh.vertices.size(), mesh.normals.size(), mesh.triangles.size()};
  std::string bytes;
  put(bytes, counts);
  put(bytes, mesh.vertices);
  put(bytes, mesh.normals);
  put(bytes, mesh.triangles);
  return bytes;
}

/// Takes values from the front; false where there are fewer.
template <class T>
bool take(std::string_view& bytes, uint64_t count, std::vector<T>& values) {
  if (count > bytes.size() / sizeof(T)) return false;
  values.resize(count);
  if (count > 0) std::memcpy(static_cast<void*>(values.data()), bytes.data(), count * sizeof(T));
  bytes.remove_prefix(count * sizeof(T));
  return true;
}

/// Nothing where the bytes are no mesh.
std::optional<MeshData> from_bytes(std::string_view bytes) {
  MeshData mesh;
  std::vector<uint64_t> counts;
  const bool is_whole = take(bytes, 3, counts) && take(bytes, counts[0], mesh.vertices) &&
                        take(bytes, counts[1], mesh.normals) && take(bytes, counts[2], mesh.triangles);
  if (!is_whole || (!mesh.normals.empty() && mesh.normals.size() != mesh.vertices.size()))
    return std::nullopt;
  const bool in_range = std::all_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& corners) {
    return std::all_of(corners.begin(), corners.end(), [&](uint32_t i) { return i < mesh.vertices.size(); });
  });
  return in_range ? std::optional(std::move(mesh)) : std::nullopt;
}

}  // namespace

MeshData read_mesh(const fs::path& file) {
  const auto refuse = [&](const std::string& message) {
    throw Error(ErrorKind::file, file.string(), message);
  };
  const std::string extension = lower_extension(file);
  const std::vector<std::string> known{"obj", "ply", "gltf", "glb"};
  if (std::find(known.begin(), known.end(), extension) == known.end()) {
    refuse("the name does not end in a mesh format; expected .obj, .ply, .gltf or .glb");
  }
  std::error_code error;
  const uint64_t bytes = fs::file_size(file, error);
  if (error) refuse(fmt::format("cannot be read: {}", error.message()));
  const uint64_t memory = kMemoryPerByte * bytes + kLeastMemory;
  require_memory(file.string(), "mesh", memory);

  static const auto read = reinterpret_cast<decltype(&pileus_read_mesh)>(
      load_own_library(kMeshesFile, "pileus_meshes_version", "pileus_read_mesh", "mesh files need it"));
  // Damaged files lead assimp into endless loops and worse. An answer starts with whether there is a mesh.
  const auto answer = run_apart(
      [&] {
        MeshData mesh;
        std::string reason;
        return read(file.string(), extension, mesh, reason) ? "1" + to_bytes(mesh) : "0" + reason;
      },
      {kLeastSeconds + kSecondsPerByte * double(bytes), memory});
  if (!answer || answer->empty()) refuse("no mesh can be read from it: its reader came to no end");
  if (answer->front() == '0') refuse(answer->substr(1));
  std::optional<MeshData> mesh = from_bytes(std::string_view(*answer).substr(1));
  if (!mesh) refuse("no mesh can be read from it: its reader lost its way");
  join_equal_vertices(*mesh);
  return std::move(*mesh);
}

}  // namespace pileus
