#include "lib/image/grey_png.h"

#include <cstdlib>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <zlib.h>

#include "lib/core/error.h"
#include "lib/core/parallel.h"
#include "tests/fixtures/temp_folder.h"

namespace pileus {
namespace {

std::string big_endian(uint32_t number) {
  return {char(number >> 24), char(number >> 16), char(number >> 8), char(number)};
}

std::string chunk(const std::string& name, const std::string& data) {
  const std::string summed = name + data;
  const auto sum = crc32(0, reinterpret_cast<const Bytef*>(summed.data()), uInt(summed.size()));
  return big_endian(uint32_t(data.size())) + summed + big_endian(uint32_t(sum));
}

std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(uLong(bytes.size()));
  std::string result(size, '\0');
  compress(reinterpret_cast<Bytef*>(result.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
           uLong(bytes.size()));
  result.resize(size);
  return result;
}

/// What a PNG file of grey values says of itself.
struct Form {
  int width = 0, height = 0, bits = 16, colours = 0, interlace = 0;
};

/// chunk_bytes: how much of the stream each chunk holds
std::string png(const Form& form, const std::string& stream, size_t chunk_bytes = 8192,
                const std::string& more = "") {
  std::string file =
      "\x89PNG\r\n\x1a\n" +
      chunk("IHDR", big_endian(uint32_t(form.width)) + big_endian(uint32_t(form.height)) + char(form.bits) +
                        char(form.colours) + '\0' + '\0' + char(form.interlace));
  file += chunk("tEXt", "Comment") + more;
  for (size_t at = 0; at < stream.size(); at += chunk_bytes)
    file += chunk("IDAT", stream.substr(at, chunk_bytes));
  return file + chunk("tIME", "") + chunk("IEND", "");
}

/// What a filter predicts of a byte, as the standard words it.
int predicted(int filter, int left, int above, int corner) {
  const int p = left + above - corner;
  const int to[] = {std::abs(p - left), std::abs(p - above), std::abs(p - corner)};
  const int nearest = to[0] <= to[1] && to[0] <= to[2] ? left : to[1] <= to[2] ? above : corner;
  const int all[] = {0, left, above, (left + above) / 2, nearest};
  return all[filter];
}

/// filter(y): of a row
template <class Filter>
std::string filtered(const Form& form, const std::vector<float>& numbers, Filter&& filter) {
  const int pixel = form.bits / 8, count = form.width * pixel;
  const auto byte = [&](int x, int y) {
    if (x < 0 || y < 0) return 0;
    const int number = int(numbers[size_t(y) * size_t(form.width) + size_t(x / pixel)]);
    return pixel == 2 && x % 2 == 0 ? number >> 8 : number & 255;
  };
  std::string rows;
  for (int y = 0; y < form.height; ++y) {
    rows += char(filter(y));
    for (int x = 0; x < count; ++x)
      rows +=
          char(byte(x, y) - predicted(filter(y), byte(x - pixel, y), byte(x, y - 1), byte(x - pixel, y - 1)));
  }
  return rows;
}

class GreyPng : public testing::Test {
 protected:
  TempFolder m_folder;

  std::filesystem::path write(const std::string& bytes) const {
    const std::filesystem::path file = m_folder.path() / "a.png";
    std::filesystem::remove(file);  // some file systems flush what is overwritten
    std::ofstream(file, std::ios::binary) << bytes;
    return file;
  }

  static std::vector<float> numbers(const Form& form) {
    std::mt19937 random(3);
    std::vector<float> values(size_t(form.width) * size_t(form.height));
    float at = 0.0F;
    for (float& value : values) {
      at = float((int(at) + int(random() % 700)) % (1 << form.bits));
      value = at;
    }
    return values;
  }

  bool is_refused(const std::string& bytes) const {
    try {
      read_grey_png(write(bytes));
    } catch (const Error&) {
      return true;
    }
    return false;
  }
};

TEST_F(GreyPng, undoes_every_filter_across_bands_and_chunks) {
  for (const int bits : {8, 16}) {
    const Form form{.width = 613, .height = 1201, .bits = bits};
    const std::vector<float> values = numbers(form);
    for (int filter = 0; filter <= 5; ++filter) {
      const std::string rows =
          filtered(form, values, [&](int y) { return filter == 5 ? (y * 7 + y / 3) % 5 : filter; });
      const std::string stream = deflated(rows);
      for (const size_t bytes : {size_t(77), stream.size()}) {
        for (const int threads : {1, 2}) {
          std::optional<NumberPlane> plane;
          const auto file = write(png(form, stream, bytes));
          with_threads(threads, [&] { plane = read_grey_png(file); });
          ASSERT_TRUE(plane);
          ASSERT_EQ(plane->width, form.width);
          ASSERT_EQ(plane->height, form.height);
          ASSERT_TRUE(std::equal(values.begin(), values.end(), plane->values.begin(), plane->values.end()))
              << bits << " bits, filter " << filter << ", chunks of " << bytes;
        }
      }
    }
  }
}

TEST_F(GreyPng, leaves_what_it_does_not_know_to_others) {
  const std::string stream = deflated("12345678901234567890");
  for (const Form& form :
       {Form{2, 2, 16, 4}, Form{2, 2, 8, 2}, Form{2, 2, 8, 3}, Form{2, 2, 4}, Form{2, 2, 8, 0, 1}})
    EXPECT_FALSE(read_grey_png(write(png(form, stream)))) << form.bits << " " << form.colours;
  EXPECT_FALSE(read_grey_png(write(png({2, 2, 8}, stream, 8192, chunk("tRNS", "12")))));
  EXPECT_FALSE(read_grey_png(write(png({2, 2, 8}, stream, 8192, chunk("ABCD", "")))));
  EXPECT_FALSE(read_grey_png(write("\x89PNG\r\n\x1a\n")));
  EXPECT_FALSE(read_grey_png(write("GIF89a")));
  EXPECT_FALSE(read_grey_png(m_folder.path() / "missing.png"));
}

TEST_F(GreyPng, refuses_streams_that_do_not_fit_though_check_sums_do) {
  const Form form{3, 2, 8};
  const std::string rows("\0abc\0def", 8), stream = deflated(rows);
  EXPECT_FALSE(is_refused(png(form, stream)));
  EXPECT_FALSE(is_refused(png(form, stream, 1)));
  EXPECT_TRUE(is_refused(png(form, deflated(rows.substr(0, 7)))));
  EXPECT_TRUE(is_refused(png(form, deflated(rows + 'x'))));
  EXPECT_TRUE(is_refused(png(form, deflated(std::string("\0abc\5def", 8)))));
  EXPECT_TRUE(is_refused(png({0, 2, 8}, stream)));
  EXPECT_TRUE(is_refused(png({3, 1 << 29, 8}, stream)));
  EXPECT_TRUE(is_refused(png({1 << 15, 1 << 15, 8}, stream))) << "1 GiB of which there is nothing";
  for (size_t n = 0; n < stream.size(); ++n)
    EXPECT_TRUE(is_refused(png(form, stream.substr(0, n))) || n == 0) << n;
  std::string wrong = stream;
  wrong.back() = char(wrong.back() ^ 1);
  EXPECT_TRUE(is_refused(png(form, wrong))) << "the stream's own check sum";
  const std::string whole = png(form, stream);
  for (size_t n = 1; n <= 12; ++n) EXPECT_TRUE(is_refused(whole.substr(0, whole.size() - n))) << n;
}

TEST_F(GreyPng, survives_any_stream) {
  const Form form{.width = 61, .height = 80, .bits = 16};
  const std::string stream = deflated(filtered(form, numbers(form), [](int y) { return y % 5; }));
  std::mt19937 random(1);
  int refused = 0;
  for (int round = 0; round < 400; ++round) {
    std::string bent = stream;
    for (unsigned k = 0; k <= random() % 4; ++k) bent[random() % bent.size()] = char(random());
    if (random() % 4 == 0) bent.resize(random() % bent.size() + 1);
    refused += is_refused(png(form, bent, 1 + random() % 3000)) ? 1 : 0;
  }
  EXPECT_GT(refused, 380);
}

}  // namespace
}  // namespace pileus
