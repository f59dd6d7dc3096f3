#include "lib/image/image_io.h"

#include <cmath>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "tests/fixtures/temp_folder.h"

namespace pileus {
namespace {

namespace fs = std::filesystem;

const fs::path kData = PILEUS_DATA_DIR;

std::string read_bytes(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string refusal(const fs::path& file) {
  try {
    read_image(file);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::file);
    return error.what();
  }
  ADD_FAILURE() << file << " was read";
  return {};
}

/// A 2x1 picture in a text format: maximum 4, values (0 1 2) (3 4 4).
TEST(ImageIo, integers_are_linearised_by_the_srgb_curve) {
  const TempFolder folder;
  std::ofstream(folder / "a.ppm") << "P3 2 1 255\n0 51 102 153 204 255\n";
  const Image image = read_image(folder / "a.ppm");
  ASSERT_EQ(image.pixel_count(), 2u);
  for (int i = 0; i < 6; ++i) {
    EXPECT_NEAR(image.channels[size_t(i % 3)].values[size_t(i / 3)], linear_from_srgb(0.2 * i), 1e-6);
  }
}

TEST(ImageIo, write_image_chooses_by_extension) {
  const TempFolder folder;
  Image image{1, 1, {}, {}};
  for (const char* name : {"R", "G", "B", "error_bound"}) image.add(name).values = {0.3f};
  write_image(folder / "a.EXR", image);
  write_image(folder / "a.png", image);
  EXPECT_EQ(read_image(folder / "a.EXR").channels.size(), 4u);
  EXPECT_EQ(read_image(folder / "a.png").channels.size(), 3u);
  EXPECT_EQ(read_bytes(folder / "a.png").substr(1, 3), "PNG");
}

TEST(ImageIo, other_extensions_are_refused_with_the_allowed_ones) {
  const auto message_for = [](const char* name) -> std::string {
    try {
      check_image_name(name);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::usage);
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(message_for("a.xer"),
            "a.xer: error: the name ends in \".xer\"; expected .exr or .png; nearest: .exr");
  EXPECT_EQ(message_for("a.tiff"), "a.tiff: error: the name ends in \".tiff\"; expected .exr or .png");
  EXPECT_EQ(message_for("exr"), "exr: error: the name ends in \"\"; expected .exr or .png");
  EXPECT_EQ(message_for("a.PNG"), "accepted");
}

TEST(ImageIo, what_cannot_be_read_is_named) {
  const TempFolder folder;
  std::ofstream(folder / "text.png") << "not a picture";
  std::ofstream(folder / "empty.tif");
  EXPECT_EQ(refusal(folder / "missing.png"),
            (folder / "missing.png").string() + ": error: does not exist; expected a picture");
  for (const fs::path& file :
       {folder / "text.png", folder / "empty.tif", folder.path(), fs::path("/dev/zero")}) {
    EXPECT_EQ(refusal(file).find(file.string() + ": error: "), 0u);
  }
}

TEST(ImageIo, the_content_decides_not_the_name) {
  const TempFolder folder;
  Image image{1, 1, {}, {}};
  image.add("Y").values = {0.5f};
  write_image(folder / "a.exr", image);
  fs::rename(folder / "a.exr", folder / "a.png");
  EXPECT_EQ(read_image(folder / "a.png").find("Y")->values, std::vector<float>{0.5f});
}

TEST(ImageIo, a_header_that_claims_too_much_is_refused) {
  const TempFolder folder;
  std::ofstream(folder / "a.pfm") << "PF\n2000000 1000000\n-1\nxxxx";
  std::ofstream(folder / "a.ppm") << "P6 60000 30000 255\nxxxx";
  EXPECT_FALSE(refusal(folder / "a.pfm").empty());
  EXPECT_FALSE(refusal(folder / "a.ppm").empty());
}

TEST(ImageIo, truncated_pictures_are_refused) {
  const TempFolder folder;
  for (const char* name : {"pov/plasma2.png", "pov/test.png", "reference/arnold_test_0030/reference.tif",
                           "reference/mitsuba3_participating_media/refs/test_homo_area_light_ref_rgb.exr"}) {
    if (!fs::exists(kData / name)) GTEST_SKIP() << kData / name << " is missing";
    EXPECT_GT(read_image(kData / name).pixel_count(), 0u);
    const std::string bytes = read_bytes(kData / name);
    const fs::path cut = folder / ("cut" + fs::path(name).extension().string());
    for (const double part : {0.0, 0.002, 0.01, 0.1, 0.5, 0.9}) {
      std::ofstream(cut, std::ios::binary) << bytes.substr(0, size_t(part * double(bytes.size())));
      EXPECT_NE(refusal(cut), "") << name << " cut to " << part;
    }
  }
}

}  // namespace
}  // namespace pileus
