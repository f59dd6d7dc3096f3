#include "lib/geom/meshes/meshes.h"

#include <algorithm>
#include <cmath>

#include <assimp/Importer.hpp>
#include <assimp/importerdesc.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include "lib/core/version.h"

namespace pileus {
namespace {

/// Only what the name promises is read: of assimp's forty formats the others stay shut.
void keep_importers_of(Assimp::Importer& importer, const std::string& extension) {
  for (size_t i = importer.GetImporterCount(); i-- > 0;) {
    const std::string known = std::string(" ") + importer.GetImporterInfo(i)->mFileExtensions + " ";
    if (known.find(" " + extension + " ") == std::string::npos)
      importer.UnregisterLoader(importer.GetImporter(i));
  }
}

bool is_finite(const aiVector3D& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// Appends one part; returns what is wrong with it, or "".
std::string append(const aiMesh& part, bool with_normals, MeshData& mesh) {
  if (!part.HasPositions() || !part.HasFaces()) return "";
  const uint32_t first = uint32_t(mesh.vertices.size());
  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    const aiVector3D& p = part.mVertices[i];
    if (!is_finite(p))
      return fmt::format("vertex {} is ({}, {}, {}); expected finite numbers", i + 1, p.x, p.y, p.z);
    mesh.vertices.emplace_back(p.x, p.y, p.z);
    if (!with_normals) continue;
    const aiVector3D& n = part.mNormals[i];
    mesh.normals.push_back(is_finite(n) ? Vec3f(n.x, n.y, n.z) : Vec3f(0.0f));
  }
  for (unsigned i = 0; i < part.mNumFaces; ++i) {
    const aiFace& face = part.mFaces[i];
    if (face.mNumIndices != 3) continue;
    std::array<uint32_t, 3>& corners = mesh.triangles.emplace_back();
    for (unsigned k = 0; k < 3; ++k) {
      if (face.mIndices[k] >= part.mNumVertices)
        return fmt::format("face {} has vertex {}; expected 0 to {}", i + 1, face.mIndices[k],
                           part.mNumVertices - 1);
      corners[k] = first + face.mIndices[k];
    }
  }
  return "";
}

bool read(const std::string& file, const std::string& extension, MeshData& mesh, std::string& reason) {
  Assimp::Importer importer;
  keep_importers_of(importer, extension);
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS, aiComponent_COLORS | aiComponent_TEXCOORDS |
                                                          aiComponent_TANGENTS_AND_BITANGENTS |
                                                          aiComponent_BONEWEIGHTS | aiComponent_ANIMATIONS |
                                                          aiComponent_TEXTURES | aiComponent_LIGHTS |
                                                          aiComponent_CAMERAS);
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  // Assimp's joining of vertices takes near ones for equal: it would open cracks.
  const aiScene* scene = importer.ReadFile(file, aiProcess_ValidateDataStructure | aiProcess_RemoveComponent |
                                                     aiProcess_Triangulate | aiProcess_SortByPType |
                                                     aiProcess_PreTransformVertices);
  if (!scene)
    return reason = fmt::format("no mesh can be read from it: {}", importer.GetErrorString()), false;

  const bool with_normals = std::all_of(scene->mMeshes, scene->mMeshes + scene->mNumMeshes,
                                        [](const aiMesh* part) { return part->HasNormals(); });
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) {
    reason = append(*scene->mMeshes[i], with_normals, mesh);
    if (!reason.empty()) return false;
  }
  if (mesh.triangles.empty()) reason = "holds no triangles; expected some";
  return reason.empty();
}

}  // namespace
}  // namespace pileus

const char* pileus_meshes_version() {
  return pileus::kVersion;
}

bool pileus_read_mesh(const std::string& file, const std::string& extension, pileus::MeshData& mesh,
                      std::string& reason) {
  try {
    return pileus::read(file, extension, mesh, reason);
  } catch (const std::exception& error) {
    reason = fmt::format("no mesh can be read from it: {}", error.what());
    return false;
  }
}
