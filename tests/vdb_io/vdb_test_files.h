#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

#include <gtest/gtest.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>

#include "lib/core/error.h"
#include "vdb_io/openvdb/openvdb_library.h"

/// Names a file of the outside test data, or skips the test where it is missing.
#define PILEUS_REAL_FILE(variable, name)                                                  \
  const std::filesystem::path variable = std::filesystem::path(PILEUS_DATA_DIR) / (name); \
  if (!std::filesystem::exists(variable)) GTEST_SKIP() << "no " << (name) << " in PILEUS_DATA_DIR"

namespace pileus {

/// What `call` complains about: the text of its Error, which must have exactly one diagnostic; "" where it
/// does not throw.
template <class Call>
std::string error_of(const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    EXPECT_EQ(error.diagnostics().size(), 1u);
    return error.what();
  }
  return "";
}

inline void expect_mentions(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << "in: " << text << "\nexpected: " << part;
}

/// Writes grids as OpenVDB does, past all checks of pileus.
inline void write_with_openvdb(const std::filesystem::path& path, const openvdb::GridCPtrVec& grids,
                               uint32_t compression = openvdb::io::COMPRESS_BLOSC |
                                                      openvdb::io::COMPRESS_ACTIVE_MASK) {
  openvdb::io::File file(path.string());
  file.setCompression(compression);
  file.write(grids);
}

/// A fog volume of one voxel edge per metre, named "density".
template <class Grid = openvdb::FloatGrid>
typename Grid::Ptr make_grid(const std::string& name = "density",
                             openvdb::GridClass grid_class = openvdb::GRID_FOG_VOLUME) {
  initialize_openvdb();
  auto grid = Grid::create();
  grid->setName(name);
  grid->setGridClass(grid_class);
  return grid;
}

/// A fog volume of some 800 voxels with values of 1 to 5, strewn over 22^3, and an active tile beside them.
inline openvdb::FloatGrid::Ptr scattered_voxels(double voxel = 0.5) {
  auto grid = make_grid();
  std::mt19937 random(7);
  std::uniform_int_distribution<int> place(-9, 12);
  for (int i = 0; i < 900; ++i) {
    grid->tree().setValueOn(openvdb::Coord(place(random), place(random), place(random)),
                            float(1 + random() % 5));
  }
  grid->tree().addTile(1, openvdb::Coord(16, 0, 0), 2.0f, true);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
  return grid;
}

inline std::string read_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

}  // namespace pileus
