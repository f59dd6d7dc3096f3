// Mesh files: what is read, and what is refused.
#include "lib/geom/mesh_file.h"

#include <cmath>
#include <cstring>
#include <fstream>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "lib/core/memory_budget.h"
#include "lib/geom/placement_table.h"
#include "tests/fixtures/temp_folder.h"

namespace pileus {
namespace {

class MeshFile : public testing::Test {
 protected:
  TempFolder m_folder;

  std::filesystem::path write(const std::string& name, const std::string& bytes) {
    std::ofstream(m_folder / name, std::ios::binary) << bytes;
    return m_folder / name;
  }
  MeshData read(const std::string& name, const std::string& bytes) { return read_mesh(write(name, bytes)); }

  std::string complaint(const std::string& name, const std::string& bytes) {
    try {
      read(name, bytes);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::file);
      EXPECT_EQ(error.diagnostics()[0].loc.file, (m_folder / name).string());
      return error.diagnostics()[0].message;
    }
    return "";
  }
};

const std::string kObj =
    "o square\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5\nf 1 2 3 4\n"
    "o fin\nv 0 0 1\nv 1 0 1\nv 0 1 1\nf 5 6 7\n";

const std::string kPly =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";

template <class T>
void put(std::string& bytes, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

std::string binary_ply() {
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
      "float "
      "z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  for (const float value : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) put(bytes, value);
  put(bytes, uint8_t(3));
  for (const int32_t index : {0, 1, 2}) put(bytes, index);
  return bytes;
}

/// One triangle with normals, moved 10 m along x by its node.
std::string glb() {
  std::string data;
  for (const float value : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) put(data, value);
  for (int k = 0; k < 3; ++k) put(data, 0.f), put(data, 0.f), put(data, 1.f);
  for (const uint16_t index : {0, 1, 2, 0}) put(data, index);
  std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"translation":[10,0,0]}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1},"indices":2}]}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},)"
      R"({"bufferView":1,"componentType":5126,"count":3,"type":"VEC3"},)"
      R"({"bufferView":2,"componentType":5123,"count":3,"type":"SCALAR"}],)"
      R"("bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":36},)"
      R"({"buffer":0,"byteOffset":72,"byteLength":6}],"buffers":[{"byteLength":80}]})";
  while (json.size() % 4) json += ' ';
  std::string bytes = "glTF";
  put(bytes, uint32_t(2)), put(bytes, uint32_t(12 + 8 + json.size() + 8 + data.size()));
  put(bytes, uint32_t(json.size()));
  bytes += "JSON" + json;
  put(bytes, uint32_t(data.size()));
  bytes += std::string("BIN\0", 4) + data;
  return bytes;
}

TEST_F(MeshFile, reads_obj_with_larger_faces_and_parts) {
  const MeshData mesh = read("two.obj", kObj);
  EXPECT_EQ(mesh.triangles.size(), 3u);
  EXPECT_EQ(mesh.vertices.size(), 7u);
  EXPECT_TRUE(mesh.normals.empty());
}

TEST_F(MeshFile, reads_ply_of_both_kinds) {
  EXPECT_EQ(read("a.ply", kPly).triangles.size(), 2u);
  EXPECT_EQ(read("a.ply", kPly).vertices.size(), 4u);
  EXPECT_EQ(read("B.PLY", binary_ply()).triangles.size(), 1u);
}

TEST_F(MeshFile, reads_glb_where_its_nodes_put_it) {
  const MeshData mesh = read("a.glb", glb());
  ASSERT_EQ(mesh.triangles.size(), 1u);
  Box3d box;
  for (const Vec3f& p : mesh.vertices) box.extendBy(Vec3d(p));
  EXPECT_EQ(box.min, Vec3d(10, 0, 0));
  EXPECT_EQ(box.max, Vec3d(11, 1, 0));
  ASSERT_EQ(mesh.normals.size(), 3u);
  EXPECT_EQ(mesh.normals[0], Vec3f(0, 0, 1));
}

TEST_F(MeshFile, says_what_is_wrong) {
  EXPECT_EQ(complaint("a.stl", "solid"),
            "the name does not end in a mesh format; expected .obj, .ply, .gltf or .glb");
  EXPECT_EQ(complaint("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n").find("no mesh can be read from it"), 0u);
  EXPECT_EQ(complaint("empty.ply", "").find("no mesh can be read from it"), 0u);
  EXPECT_EQ(complaint("text.glb", "this is no mesh").find("no mesh can be read from it"), 0u);
  std::string nan = binary_ply();
  const float bad = std::nanf("");
  std::memcpy(nan.data() + nan.size() - 13 - 12, &bad, sizeof(bad));
  EXPECT_NE(complaint("nan.ply", nan).find("expected finite numbers"), std::string::npos);
  EXPECT_NE(complaint("far.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"), "");
  EXPECT_THROW(read_mesh(m_folder / "none.obj"), Error);
}

TEST_F(MeshFile, asks_for_memory_first) {
  const std::filesystem::path file = write("a.ply", kPly);
  set_memory_budget(1000000);
  EXPECT_THROW(read_mesh(file), Error);
  set_memory_budget(0);
}

/// Damaged files are read as far as they make sense, or refused; nothing else.
TEST_F(MeshFile, survives_damage) {
  std::mt19937 random(3);
  size_t refused = 0, read_anyway = 0;
  const std::pair<const char*, std::string> files[] = {
      {"d.obj", kObj}, {"d.ply", kPly}, {"e.ply", binary_ply()}, {"d.glb", glb()}};
  for (const auto& [name, whole] : files) {
    for (int n = 0; n < 20; ++n) {
      std::string bytes = whole;
      if (n % 4 == 0) bytes.resize(random() % bytes.size());
      for (unsigned k = random() % 4; k > 0 && !bytes.empty(); --k) {
        bytes[random() % bytes.size()] = n % 2 ? char(random() % 256) : char('0' + random() % 10);
      }
      try {
        const MeshData mesh = read(name, bytes);
        ++read_anyway;
        for (const Vec3f& p : mesh.vertices) ASSERT_TRUE(std::isfinite(p.x + p.y + p.z));
        for (const auto& corners : mesh.triangles) {
          for (const uint32_t i : corners) ASSERT_LT(i, mesh.vertices.size());
        }
      } catch (const Error& error) {
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, 10u);
  EXPECT_GT(read_anyway, 10u);
}

TEST_F(MeshFile, tables_of_places_are_read) {
  const auto places = read_placement_table(
      write("a.csv", "x,y,z,scale,turn\n1,2,3\n# none\n -1.5e2, 0 ,3 , 0.5\r\n\n1,2,3,2,-90 # turned\n"));
  ASSERT_EQ(places.size(), 3u);
  EXPECT_EQ(places[0].position, Vec3d(1, 2, 3));
  EXPECT_EQ(places[0].scale, 1.0);
  EXPECT_EQ(places[1].position, Vec3d(-150, 0, 3));
  EXPECT_EQ(places[1].scale, 0.5);
  EXPECT_EQ(places[2].turn_deg, -90.0);
}

TEST_F(MeshFile, tables_of_places_are_checked) {
  const auto complaint_about = [&](const std::string& text) -> std::string {
    try {
      read_placement_table(write("a.csv", text));
    } catch (const Error& error) {
      return std::to_string(error.diagnostics()[0].loc.line) + ": " + error.diagnostics()[0].message;
    }
    return "";
  };
  EXPECT_EQ(complaint_about("1,2,3\n1,two,3\n"), "2: found \"two\"; expected a number");
  EXPECT_EQ(complaint_about("1,2\n"),
            "1: found 2 numbers; expected x,y,z or x,y,z,scale or x,y,z,scale,turn");
  EXPECT_EQ(complaint_about("1,2,3,-1\n"), "1: scale = -1; expected > 0");
  EXPECT_EQ(complaint_about("1,2,inf\n"), "1: found \"inf\"; expected a number");
  EXPECT_EQ(complaint_about("1,2,\n"), "1: found \"\"; expected a number");
  EXPECT_EQ(complaint_about("\n"), "0: holds no places; expected lines x,y,z,scale,turn");
}

}  // namespace
}  // namespace pileus
