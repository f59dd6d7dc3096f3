#pragma once

#include <filesystem>

#include "lib/geom/triangle_mesh.h"

namespace pileus {

/// Reads the triangles of an OBJ, PLY, glTF or GLB file, all of its parts placed as the file says; larger
/// faces are cut into triangles, points and lines left out. Vertices have normals where all parts of the file
/// give them. errors: Error(file) where the file is missing, damaged, has no triangles, numbers that are not
/// finite, or would need more memory than the budget
MeshData read_mesh(const std::filesystem::path& file);

}  // namespace pileus
