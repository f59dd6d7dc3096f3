#include "vdb_io/vdb_transform.h"

#include <cmath>
#include <map>

#include <fmt/format.h>

#include "lib/core/error.h"
#include "vdb_io/file_cursor.h"

namespace pileus {
namespace {

Vec3d get_vector(FileCursor& file) {
  Vec3d v;
  for (int axis = 0; axis < 3; ++axis) v[axis] = file.get<double>("a grid's transform");
  return v;
}

/// What stands in the file: a matrix; or a translation, then a scale, or one of them. What follows these
/// (inverses and the like) says the same again.
Imath::M44d read_matrix(FileCursor& file, const std::string& map_type) {
  Imath::M44d matrix;
  if (map_type == "AffineMap" || map_type == "UnitaryMap") {
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) matrix[i][j] = file.get<double>("a grid's transform");
    }
    return matrix;
  }
  if (map_type.find("Translat") != std::string::npos) {
    const Vec3d offset = get_vector(file);
    for (int axis = 0; axis < 3; ++axis) matrix[3][axis] = offset[axis];
  }
  if (map_type.find("Scale") != std::string::npos) {
    const Vec3d factors = get_vector(file);
    for (int axis = 0; axis < 3; ++axis) matrix[axis][axis] = factors[axis];
  }
  return matrix;
}

}  // namespace

uint64_t map_bytes(const std::string& map_type) {
  static const std::map<std::string, uint64_t> kBytes{{"AffineMap", 128},
                                                      {"UnitaryMap", 128},
                                                      {"TranslationMap", 24},
                                                      {"ScaleMap", 120},
                                                      {"UniformScaleMap", 120},
                                                      {"ScaleTranslateMap", 144},
                                                      {"UniformScaleTranslateMap", 144}};
  const auto found = kBytes.find(map_type);
  return found == kBytes.end() ? 0 : found->second;
}

Affine read_world_from_index(const std::filesystem::path& path, const VdbGridEntry& grid) {
  PILEUS_CHECK(grid.has_affine_map());
  FileCursor file(path);
  file.enter(grid.topology_begin - map_bytes(grid.map_type), grid.topology_begin);
  return checked_world_from_index(path, grid.name, read_matrix(file, grid.map_type));
}

Affine checked_world_from_index(const std::filesystem::path& path, const std::string& grid,
                                const Imath::M44d& matrix) {
  bool is_finite = true;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) is_finite = is_finite && std::isfinite(matrix[i][j]);
  }
  if (!is_finite) refuse_transform(path, grid, "non-finite");
  if (matrix[0][3] != 0.0 || matrix[1][3] != 0.0 || matrix[2][3] != 0.0 || matrix[3][3] != 1.0)
    refuse_transform(path, grid, "projective");
  const Affine world_from_index(matrix);
  // Relative to its own edges, so that tiny voxels are not taken for a singular map.
  const Vec3d edges = voxel_edges(world_from_index);
  const double volume = std::abs(world_from_index.determinant());
  if (!std::isfinite(volume) || !(volume > 1e-12 * edges.x * edges.y * edges.z))
    refuse_transform(path, grid, "singular");
  return world_from_index;
}

void refuse_transform(const std::filesystem::path& path, const std::string& grid, const char* found) {
  throw Error(
      ErrorKind::file, path.string(),
      fmt::format("grid \"{}\" has a {} transform; expected an invertible one; repair it where it was made",
                  grid, found));
}

Vec3d voxel_edges(const Affine& world_from_index) {
  return {world_from_index.direction({1, 0, 0}).length(), world_from_index.direction({0, 1, 0}).length(),
          world_from_index.direction({0, 0, 1}).length()};
}

}  // namespace pileus
