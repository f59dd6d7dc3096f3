#pragma once

#include <string>

#include "lib/geom/triangle_mesh.h"

// What libpileus and libpileus_meshes say to each other. Mesh files are read by assimp, whose start would
// cost every run: it lies in a library of its own, loaded with the first mesh (lib/geom/mesh_file.cpp).
namespace pileus {

inline constexpr const char* kMeshesFile = "libpileus_meshes.so";

}  // namespace pileus

/// The version of pileus that the library was built with: classes cross this border, so it must be the same.
extern "C" const char* pileus_meshes_version();

/// Appends the triangles of a file to a mesh; false with a reason where that fails. It knows nothing of
/// pileus::Error.
///   extension: the name's, in lower case, without the dot; only readers of such files are tried
extern "C" bool pileus_read_mesh(const std::string& file, const std::string& extension,
                                 pileus::MeshData& mesh, std::string& reason);
