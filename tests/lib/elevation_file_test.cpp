#include "lib/terrain/elevation_file.h"

#include <fstream>

#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "lib/core/memory_budget.h"
#include "tests/fixtures/temp_folder.h"

namespace pileus {
namespace {

const std::string kGrid = "ncols 3\nnrows 2\nxllcorner 500\nyllcorner 900\ncellsize 25\nNODATA_value -1\n";

class ElevationFile : public testing::Test {
 protected:
  TempFolder m_folder;

  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    const std::filesystem::path file = m_folder.path() / name;
    std::ofstream(file, std::ios::binary) << bytes;
    return file;
  }
};

TEST_F(ElevationFile, ascii_grids_keep_cells_and_holes) {
  const HeightTable table = read_elevation(write("a.asc", kGrid + "1 2 3\n4 -1 6.5\n"));
  EXPECT_EQ(table.columns, 3);
  EXPECT_EQ(table.rows, 2);
  EXPECT_EQ(table.cell_x, 25.0);
  EXPECT_EQ(table.heights[5], 6.5F);
  EXPECT_TRUE(std::isnan(table.heights[4]));
}

TEST_F(ElevationFile, srtm_tiles_have_degrees) {
  std::string bytes("\x00\x01\x80\x00\xff\xff\x00\x10", 8);
  const HeightTable table = read_elevation(write("N46E007.hgt", bytes));
  EXPECT_EQ(table.heights[0], 1.0F);
  EXPECT_TRUE(std::isnan(table.heights[1]));
  EXPECT_EQ(table.heights[2], -1.0F);
  EXPECT_NEAR(table.cell_x, 76840.0, 200.0) << "a degree of longitude at 46.5 N";
  EXPECT_NEAR(table.cell_y, 111161.0, 10.0);
}

TEST_F(ElevationFile, numpy_arrays_are_read_in_both_orders) {
  const auto npy = [&](const std::string& order) {
    std::string header = "{'descr': '<i2', 'fortran_order': " + order + ", 'shape': (2, 3), }\n";
    std::string head = "\x93NUMPY";
    head += {1, 0, char(header.size()), 0};
    return head + header + std::string("\1\0\2\0\3\0\4\0\5\0\xff\xff", 12);
  };
  EXPECT_EQ(read_elevation(write("c.npy", npy("False"))).heights, (HeightValues{1, 2, 3, 4, 5, -1}));
  EXPECT_EQ(read_elevation(write("f.npy", npy("True"))).heights, (HeightValues{1, 3, 5, 2, 4, -1}));
  const std::string whole = npy("False");
  for (size_t n = 0; n < whole.size(); ++n) {
    EXPECT_THROW(read_elevation(write("cut.npy", whole.substr(0, n))), Error) << n;
  }
}

TEST_F(ElevationFile, long_numpy_arrays_are_read_piece_by_piece) {
  constexpr int kColumns = 701, kRows = 1003;  // more than a stretch, and no whole number of pieces
  std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (1003, 701), }\n";
  std::string bytes = "\x93NUMPY";
  bytes += {1, 0, char(header.size()), 0};
  bytes += header;
  for (int k = 0; k < kColumns * kRows; ++k) {
    float z = float(k);
    if (k == 300001) z = std::numeric_limits<float>::infinity();
    bytes.append(reinterpret_cast<const char*>(&z), sizeof(z));
  }
  const HeightTable table = read_elevation(write("long.npy", bytes));
  ASSERT_EQ(table.columns, kColumns);
  ASSERT_EQ(table.rows, kRows);
  for (int k = 0; k < kColumns * kRows; ++k) {
    if (k == 300001) {
      EXPECT_TRUE(std::isnan(table.heights[size_t(k)]));
    } else {
      ASSERT_EQ(table.heights[size_t(k)], float(k));
    }
  }
  bytes.pop_back();
  EXPECT_THROW(read_elevation(write("short.npy", bytes)), Error);
}

/// Bytes that are given as hexadecimal digits.
std::string from_hex(const std::string& digits) {
  std::string bytes;
  for (size_t k = 0; k + 1 < digits.size(); k += 2)
    bytes += char(std::stoi(digits.substr(k, 2), nullptr, 16));
  return bytes;
}

TEST_F(ElevationFile, grey_png_files_keep_their_numbers) {
  const std::string wide = from_hex(
      "89504e470d0a1a0a0000000d4948445200000003000000021000000000e88fe585000000164944415478da6360"
      "606060646460f8ffbf8181811d000d1d02885ef4c1ba0000000049454e44ae426082");
  const std::string narrow = from_hex(
      "89504e470d0a1a0a0000000d4948445200000003000000020800000000b81f39c6000000104944415478da6360"
      "606462f8dfc00e00041c018a687b2f0d0000000049454e44ae426082");
  EXPECT_EQ(read_elevation(write("w.png", wide)).heights, (HeightValues{0, 1, 256, 65535, 32768, 7}));
  EXPECT_EQ(read_elevation(write("n.png", narrow)).heights, (HeightValues{0, 1, 2, 255, 128, 7}));
  for (size_t n = 0; n < wide.size(); n += 3) {
    EXPECT_THROW(read_elevation(write("cut.png", wide.substr(0, n))), Error) << n;
  }
  for (size_t n = 8; n < wide.size() - 12; ++n) {
    std::string bent = wide;
    bent[n] = char(bent[n] ^ 0x10);
    EXPECT_THROW(read_elevation(write("bent.png", bent)), Error) << n << ": every byte counts in a check sum";
  }
}

TEST_F(ElevationFile, refuses_what_is_no_table_of_heights) {
  EXPECT_THROW(read_elevation(m_folder.path() / "missing.asc"), Error);
  EXPECT_THROW(read_elevation(write("a.xyz", "1 2 3")), Error);
  EXPECT_THROW(read_elevation(write("a.asc", kGrid + "1 2 3 4 5")), Error);
  EXPECT_THROW(read_elevation(write("a.asc", kGrid + "1 2 3 4 5 6 7")), Error);
  EXPECT_THROW(read_elevation(write("a.asc", kGrid + "1 2 3 4 x 6")), Error);
  EXPECT_THROW(read_elevation(write("a.asc", kGrid + "-1 -1 -1 -1 -1 -1")), Error) << "nothing but holes";
  EXPECT_THROW(read_elevation(write("a.asc", "ncols 99999999\nnrows 99999999\n1")), Error);
  EXPECT_THROW(read_elevation(write("N46E007.hgt", "123")), Error);
  EXPECT_THROW(read_elevation(write("tile.hgt", std::string(8, '\1'))), Error) << "no latitude";
  EXPECT_THROW(read_elevation(write("a.tif", "II*\0garbage")), Error);
  EXPECT_THROW(read_elevation(write("a.png", "garbage")), Error);
}

TEST_F(ElevationFile, reads_real_grids) {
  const std::filesystem::path folder = std::filesystem::path(PILEUS_DATA_DIR) / "dem";
  if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << "no " << folder;
  const HeightTable valley = read_elevation(folder / "orkhon_valley.asc");
  EXPECT_EQ(valley.columns, 98);
  EXPECT_EQ(valley.cell_y, 91.6667);
  const HeightTable canyon = read_elevation(folder / "srtm_bigtujunga30m_utm11.tif");
  EXPECT_EQ(canyon.columns, 1197);
  EXPECT_NEAR(canyon.cell_x, 30.0, 1.0);
}

}  // namespace
}  // namespace pileus
