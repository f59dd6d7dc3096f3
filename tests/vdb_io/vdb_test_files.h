#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>

#include "lib/core/error.h"
#include "vdb_io/openvdb_library.h"

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

inline std::string read_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

}  // namespace pileus
