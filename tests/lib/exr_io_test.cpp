#include "lib/image/exr_io.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "lib/image/image_limits.h"
#include "tests/fixtures/file_size_limit.h"
#include "tests/fixtures/temp_folder.h"

namespace pileus {
namespace {

namespace fs = std::filesystem;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

std::string read_bytes(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Every bit pattern may occur, so NaN payloads, denormals and infinities do too.
Image random_image(int width, int height) {
  std::mt19937 random(7);
  Image image{width, height, {}, {}};
  for (const char* name : {"A", "B", "G", "R", "Z", "samples", "sun.R"}) {
    for (float& value : image.add(name).values) value = std::bit_cast<float>(uint32_t(random()));
  }
  return image;
}

void expect_same_bits(const Image& a, const Image& b) {
  ASSERT_EQ(a.width, b.width);
  ASSERT_EQ(a.height, b.height);
  ASSERT_EQ(a.channels.size(), b.channels.size());
  for (const Channel& channel : a.channels) {
    const Channel* other = b.find(channel.name);
    ASSERT_TRUE(other) << channel.name;
    for (size_t i = 0; i < channel.values.size(); ++i) {
      ASSERT_EQ(std::bit_cast<uint32_t>(channel.values[i]), std::bit_cast<uint32_t>(other->values[i]))
          << channel.name << "[" << i << "]";
    }
  }
}

TEST(ExrIo, every_float_survives_bit_by_bit_in_every_compression) {
  const TempFolder folder;
  const Image image = random_image(37, 21);
  for (const auto compression : {ExrCompression::none, ExrCompression::rle, ExrCompression::zip_line,
                                 ExrCompression::zip, ExrCompression::piz}) {
    write_exr(folder / "a.exr", image, {.compression = compression});
    expect_same_bits(read_exr(folder / "a.exr"), image);
  }
}

TEST(ExrIo, metadata_come_back_with_their_types) {
  const TempFolder folder;
  Image image{1, 1, {}, {}};
  image.add("R");
  Imath::M44d matrix;
  matrix[3][0] = 1.0 / 3.0;
  Imath::M44d rounded;
  rounded[3][0] = double(1.0f / 3.0f);
  image.metadata = {{"scene", std::string("dusk.toml")},
                    {"tolerance", 0.1},
                    {"seed", -7},
                    {"world_from_volume", matrix},
                    {"worldToNDC", matrix}};
  write_exr(folder / "a.exr", image);
  ImageMetadata expected = image.metadata;
  expected["worldToNDC"] = rounded;
  EXPECT_EQ(read_exr(folder / "a.exr").metadata, expected);
  const std::string bytes = read_bytes(folder / "a.exr");
  EXPECT_NE(bytes.find("pileus:tolerance"), std::string::npos);
  EXPECT_EQ(bytes.find("pileus:worldToNDC"), std::string::npos);
}

TEST(ExrIo, equal_images_give_equal_bytes) {
  const TempFolder folder;
  write_exr(folder / "a.exr", random_image(64, 64));
  write_exr(folder / "b.exr", random_image(64, 64));
  EXPECT_EQ(read_bytes(folder / "a.exr"), read_bytes(folder / "b.exr"));
}

TEST(ExrIo, half_rounds_colours_only_and_never_to_infinity) {
  const TempFolder folder;
  Image image{2, 1, {}, {}};
  image.add("R").values = {1.0f / 3.0f, kInfinity};
  image.add("G").values = {1.0f / 3.0f, 1e6f};
  image.add("Z").values = {1.0f / 3.0f, 70000.0f};
  write_exr(folder / "a.exr", image, {.half_colours = true});
  const Image back = read_exr(folder / "a.exr");
  EXPECT_EQ(back.find("R")->values, (std::vector<float>{0.333251953125f, kInfinity}));
  EXPECT_EQ(back.find("G")->values, image.find("G")->values);
  EXPECT_EQ(back.find("Z")->values, image.find("Z")->values);
}

TEST(ExrIo, nothing_is_left_where_the_folder_is_missing) {
  const TempFolder folder;
  EXPECT_THROW(write_exr(folder / "missing/a.exr", random_image(2, 2)), Error);
  EXPECT_EQ(folder.file_count(), 0u);
}

TEST(ExrIo, a_name_that_exr_cannot_hold_leaves_nothing_under_the_final_name) {
  const TempFolder folder;
  Image image = random_image(2, 2);
  image.metadata[std::string(249, 'x')] = 1;
  EXPECT_THROW(write_exr(folder / "a.exr", image), Error);
  image.metadata.clear();
  image.add(std::string("a\0b", 3));
  EXPECT_THROW(write_exr(folder / "a.exr", image), Error);
  EXPECT_EQ(folder.file_count(), 0u);
}

TEST(ExrIo, a_full_disk_is_an_error_and_leaves_nothing) {
  const TempFolder folder;
  write_exr(folder / "whole.exr", random_image(60, 60));
  const auto whole_bytes = fs::file_size(folder / "whole.exr");
  for (const auto allowed : {rlim_t(0), rlim_t(100), rlim_t(whole_bytes / 2), rlim_t(whole_bytes - 1)}) {
    const FileSizeLimit limit(allowed);
    EXPECT_THROW(write_exr(folder / "a.exr", random_image(60, 60)), Error) << allowed << " bytes allowed";
  }
  EXPECT_EQ(folder.file_count(), 1u);
}

TEST(ExrIo, every_truncation_is_refused) {
  const TempFolder folder;
  write_exr(folder / "whole.exr", random_image(9, 40));
  const std::string bytes = read_bytes(folder / "whole.exr");
  for (size_t length = 0; length < bytes.size(); length += 1 + bytes.size() / 200) {
    std::ofstream(folder / "cut.exr", std::ios::binary) << bytes.substr(0, length);
    EXPECT_THROW(read_exr(folder / "cut.exr"), Error) << length << " of " << bytes.size() << " bytes";
  }
}

TEST(ExrIo, flipped_bytes_are_read_or_refused_and_never_crash) {
  const TempFolder folder;
  write_exr(folder / "whole.exr", random_image(5, 5));
  const std::string bytes = read_bytes(folder / "whole.exr");
  std::mt19937 random(11);
  for (int round = 0; round < 200; ++round) {
    std::string damaged = bytes;
    damaged[random() % 500] = char(random());
    std::ofstream(folder / "damaged.exr", std::ios::binary) << damaged;
    try {
      const Image image = read_exr(folder / "damaged.exr");
      for (const Channel& channel : image.channels) EXPECT_EQ(channel.values.size(), image.pixel_count());
    } catch (const Error&) {
    }
  }
}

TEST(ExrIo, what_is_missing_or_no_exr_file_is_named) {
  const TempFolder folder;
  std::ofstream(folder / "text.exr") << "not a picture";
  for (const fs::path& file : {folder / "missing.exr", folder / "text.exr", folder.path()}) {
    try {
      read_exr(file);
      ADD_FAILURE() << file << " was read";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::file);
      EXPECT_EQ(std::string(error.what()).find(file.string()), 0u) << error.what();
    }
  }
}

TEST(ImageLimits, a_small_file_cannot_claim_a_huge_picture) {
  const TempFolder folder;
  std::ofstream(folder / "small") << "x";
  EXPECT_NO_THROW(check_image_size(folder / "small", 8192, 8192, 4));
  EXPECT_THROW(check_image_size(folder / "small", 8192, 8193, 4), Error);
  EXPECT_THROW(check_image_size(folder / "small", 0, 10, 1), Error);
  EXPECT_THROW(check_image_size(folder / "small", 10, -1, 1), Error);
  EXPECT_THROW(check_image_size(folder / "small", int64_t(1) << 40, int64_t(1) << 40, 1), Error);
  EXPECT_THROW(check_image_size(folder / "small", 10, 10, 0), Error);
}

TEST(ExrIo, reads_a_picture_of_another_program) {
  const fs::path file = fs::path(PILEUS_DATA_DIR) /
                        "reference/mitsuba3_participating_media/refs/test_homo_area_light_ref_rgb.exr";
  if (!fs::exists(file)) GTEST_SKIP() << file << " is missing";
  const Image image = read_exr(file);
  EXPECT_EQ(image.width, 48);
  EXPECT_EQ(image.height, 48);
  ASSERT_TRUE(image.find("R"));
}

}  // namespace
}  // namespace pileus
