#include "vdb_io/dense/dense_files.h"

#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "tests/fixtures/temp_folder.h"

namespace pileus {
namespace {

/// A box of random densities with a place of its own.
DenseVolume random_volume(const Vec3i& size, int channels = 1) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> value(0.0f, 3.0f);
  std::vector<float> samples(size_t(size.x) * size_t(size.y) * size_t(size.z) * size_t(channels));
  for (float& sample : samples) sample = random() % 3 == 0 ? 0.0f : value(random);
  DenseVolume volume;
  volume.size = size;
  volume.channels = channels;
  volume.samples = std::move(samples);
  volume.header.grid = "smoke";
  volume.header.first_voxel = Vec3i(-3, 5, 100);
  volume.header.world_from_index = Affine::translation({1, 2, 3}) * Affine::scaling({0.1, 0.2, 0.3});
  volume.header.channels = channels;
  return volume;
}

const std::vector<float>& floats(const DenseVolume& volume) {
  return std::get<std::vector<float>>(volume.samples);
}

float at(const DenseVolume& volume, int i, int j, int k) {
  return floats(volume)[(size_t(k) * size_t(volume.size.y) + size_t(j)) * size_t(volume.size.x) + size_t(i)];
}

class DenseFiles : public testing::Test {
 protected:
  TempFolder folder;

  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder / name, std::ios::binary) << bytes;
    return folder / name;
  }
};

std::string read_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::string error_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

void expect_mentions(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << "in: " << text << "\nexpected: " << part;
}

// --- .df3 ---

TEST_F(DenseFiles, df3_keeps_values_within_half_a_step_and_the_place) {
  const DenseVolume volume = random_volume({7, 5, 3});
  for (const int bits : {8, 16, 32}) {
    write_df3(folder / "a.df3", volume, bits);
    const DenseVolume back = read_df3(folder / "a.df3");
    EXPECT_EQ(back.size, volume.size + Vec3i(1));
    EXPECT_EQ(back.header.first_voxel, volume.header.first_voxel - Vec3i(1));
    EXPECT_EQ(back.header.world_from_index.matrix(), volume.header.world_from_index.matrix());
    EXPECT_EQ(back.header.grid, "smoke");
    const double step = *back.header.value_scale / (std::pow(2.0, bits) - 1);
    const double rounding = 3.0 * std::ldexp(1.0, -24);  // of values as floats
    for (int k = 0; k < 3; ++k) {
      for (int j = 0; j < 5; ++j) {
        for (int i = 0; i < 7; ++i) {
          ASSERT_NEAR(at(back, i + 1, j + 1, k + 1), at(volume, i, j, k), 0.5 * step + rounding);
        }
      }
    }
  }
}

TEST_F(DenseFiles, df3_has_a_layer_of_zeros_in_front_of_each_axis) {
  write_df3(folder / "a.df3", random_volume({4, 3, 2}), 16);
  const DenseVolume back = read_df3(folder / "a.df3");
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 4; ++j) EXPECT_EQ(at(back, 0, j, k), 0.0f);
    for (int i = 0; i < 5; ++i) EXPECT_EQ(at(back, i, 0, k), 0.0f);
  }
}

TEST_F(DenseFiles, df3_written_again_is_the_same_file) {
  write_df3(folder / "a.df3", random_volume({6, 6, 6}), 8);
  DenseVolume back = read_df3(folder / "a.df3");
  const std::string first = read_file(folder / "a.df3");
  // Take the border off again, as a sparse grid does.
  DenseVolume inner = random_volume({6, 6, 6});
  auto& samples = std::get<std::vector<float>>(inner.samples);
  for (int k = 0, n = 0; k < 6; ++k) {
    for (int j = 0; j < 6; ++j) {
      for (int i = 0; i < 6; ++i) samples[size_t(n++)] = at(back, i + 1, j + 1, k + 1);
    }
  }
  write_df3(folder / "b.df3", inner, 8);
  EXPECT_EQ(read_file(folder / "b.df3"), first);
}

TEST_F(DenseFiles, df3_without_a_header_fills_the_unit_cube_as_povray_shows_it) {
  const std::string sizes{'\0', '\2', '\0', '\1', '\0', '\1'};
  const DenseVolume volume = read_df3(write("a.df3", sizes + std::string("\xff\x80\x01\x00", 4)));
  EXPECT_EQ(volume.stored, SampleType::uint16);
  EXPECT_FLOAT_EQ(at(volume, 0, 0, 0), float(0xff80) / 65535.0f) << "the high byte comes first";
  EXPECT_FLOAT_EQ(at(volume, 1, 0, 0), float(0x0100) / 65535.0f);
  EXPECT_EQ(volume.header.world_from_index.point({1, 0, 0}), Vec3d(0.5, 0, 0)) << "sample i of S is at i/S";
}

TEST_F(DenseFiles, df3_tells_povray_where_the_cube_lies_with_z_turned_over) {
  write_df3(folder / "a.df3", random_volume({9, 4, 1}), 8);
  const std::string header = read_file(folder / "a.df3.json");
  // x edge 10 * 0.1, y edge 5 * 0.2, z edge 2 * 0.3; corner (1, 2, 3) + (-4 * 0.1, 4 * 0.2, 99 * 0.3)
  expect_mentions(header,
                  "density_file df3 \\\"a.df3\\\" interpolate 1 matrix <1, 0, -0, 0, 1, -0, 0, 0, -0.6, 0.6, "
                  "2.8, -32.7>");
}

TEST_F(DenseFiles, df3_refuses_what_whole_numbers_cannot_tell) {
  DenseVolume volume = random_volume({2, 2, 2});
  std::get<std::vector<float>>(volume.samples)[3] = -0.5f;
  expect_mentions(error_of([&] { write_df3(folder / "a.df3", volume, 16); }), "holds the value -0.5");
  std::get<std::vector<float>>(volume.samples)[3] = std::nanf("");
  expect_mentions(error_of([&] { write_df3(folder / "a.df3", volume, 16); }), "holds the value nan");
  expect_mentions(error_of([&] { write_df3(folder / "a.df3", random_volume({2, 2, 2}, 3), 16); }), "vectors");
  volume = random_volume({2, 2, 2});
  volume.header.background = 1;
  expect_mentions(error_of([&] { write_df3(folder / "a.df3", volume, 16); }), "background 1");
  EXPECT_EQ(folder.file_count(), 0u);
}

TEST_F(DenseFiles, df3_of_any_wrong_length_is_refused) {
  const std::string whole = std::string{'\0', '\2', '\0', '\3', '\0', '\2'} + std::string(12, 'x');
  EXPECT_EQ(error_of([&] { read_df3(write("a.df3", whole)); }), "");
  for (size_t length = 0; length < 60; ++length) {
    const std::string bytes =
        length <= whole.size() ? whole.substr(0, length) : whole + std::string(length - 18, 'y');
    const bool is_valid = length == 18 || length == 30 || length == 54;
    EXPECT_EQ(error_of([&] { read_df3(write("a.df3", bytes)); }).empty(), is_valid) << length;
  }
  expect_mentions(error_of([&] { read_df3(write("a.df3", std::string(6, '\0'))); }), "size 1 at byte 0 is 0");
  expect_mentions(error_of([&] { read_df3(write("a.df3", std::string(6, '\xff'))); }),
                  "65535 x 65535 x 65535 samples need");
}

// --- .npy ---

/// An array file with the given dictionary; as NumPy writes it where `dictionary` is.
std::string npy_bytes(const std::string& dictionary, const std::string& data, char major = '\1') {
  const std::string text = dictionary + "\n";
  std::string bytes = "\x93NUMPY";
  bytes += major;
  bytes += '\0';
  bytes += char(text.size() & 0xff);
  bytes += char(text.size() >> 8);
  if (major > 1) bytes += std::string(2, '\0');
  return bytes + text + data;
}

template <class T>
std::string bytes_of_numbers(const std::vector<T>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(T)};
}

TEST_F(DenseFiles, npy_is_indexed_x_y_z_in_both_orders) {
  std::vector<float> c_order, fortran;
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 3; ++j) {
      for (int k = 0; k < 4; ++k) c_order.push_back(float(100 * i + 10 * j + k));
    }
  }
  for (int k = 0; k < 4; ++k) {
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 2; ++i) fortran.push_back(float(100 * i + 10 * j + k));
    }
  }
  const auto c =
      read_npy(write("c.npy", npy_bytes("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 4), }",
                                        bytes_of_numbers(c_order))));
  const auto f = read_npy(write("f.npy", npy_bytes("{'shape':(2,3,4),'fortran_order':True,'descr':\"<f4\"}",
                                                   bytes_of_numbers(fortran), '\2')));
  EXPECT_EQ(c.size, Vec3i(2, 3, 4));
  EXPECT_EQ(at(c, 1, 2, 3), 123.0f);
  EXPECT_EQ(at(c, 1, 0, 2), 102.0f);
  EXPECT_EQ(floats(c), floats(f));
}

TEST_F(DenseFiles, npy_reads_every_type_and_both_byte_orders) {
  const auto value = [&](const std::string& type, const std::string& data) {
    const DenseVolume volume = read_npy(write(
        "a.npy", npy_bytes("{'descr': '" + type + "', 'fortran_order': False, 'shape': (1, 1, 1), }", data)));
    return std::visit([](const auto& samples) { return double(samples.at(0)); }, volume.samples);
  };
  EXPECT_EQ(value("|u1", "\xc8"), 200.0);
  EXPECT_EQ(value("|i1", "\xc8"), -56.0);
  EXPECT_EQ(value("|b1", "\1"), 1.0);
  EXPECT_EQ(value("<u2", std::string("\x01\x02", 2)), 513.0);
  EXPECT_EQ(value(">u2", std::string("\x01\x02", 2)), 258.0);
  EXPECT_EQ(value("<i4", std::string("\xff\xff\xff\x7f", 4)), 2147483647.0) << "no float holds it";
  EXPECT_EQ(value(">u4", std::string("\xff\xff\xff\xff", 4)), 4294967295.0);
  EXPECT_EQ(value("<f2", std::string("\x00\x3c", 2)), 1.0);
  EXPECT_EQ(value("<f8", bytes_of_numbers<double>({0.1})), 0.1);
  EXPECT_EQ(value(">f4", std::string("\x3f\x80\x00\x00", 4)), 1.0);
}

TEST_F(DenseFiles, npy_keeps_every_bit_of_floats_doubles_and_vectors) {
  for (const int channels : {1, 3}) {
    DenseVolume volume = random_volume({5, 4, 3}, channels);
    std::get<std::vector<float>>(volume.samples)[7] = std::numeric_limits<float>::infinity();
    write_npy(folder / "a.npy", volume);
    const DenseVolume back = read_npy(folder / "a.npy");
    EXPECT_EQ(back.samples, volume.samples);
    EXPECT_EQ(back.channels, channels);
    EXPECT_EQ(back.header.first_voxel, volume.header.first_voxel);
    EXPECT_EQ(back.header.world_from_index.matrix(), volume.header.world_from_index.matrix());
  }
  DenseVolume doubles = random_volume({2, 2, 2});
  doubles.samples = std::vector<double>{0.1, 1e300, -3, 0, 5, 6, 7, 1.0 / 3};
  doubles.stored = SampleType::float64;
  write_npy(folder / "a.npy", doubles);
  EXPECT_EQ(read_npy(folder / "a.npy").samples, doubles.samples);
}

TEST_F(DenseFiles, npy_refuses_what_it_cannot_be_with_the_byte) {
  const auto refusal = [&](const std::string& bytes) {
    return error_of([&] { read_npy(write("a.npy", bytes)); });
  };
  const auto of_dictionary = [&](const std::string& dictionary, const std::string& data = "1234") {
    return refusal(npy_bytes(dictionary, data));
  };
  expect_mentions(refusal("PK\3\4 a zip archive"), "an .npz is a zip archive of them");
  expect_mentions(refusal("\x93NUMPY"), "6 bytes");
  expect_mentions(refusal(npy_bytes("{}", "", '\x09')), "version 9 at byte 6");
  expect_mentions(of_dictionary("{'descr': '<f4'}"),
                  "expected 'descr', 'fortran_order' and 'shape', each once");
  expect_mentions(of_dictionary("{'descr': '<c8', 'fortran_order': False, 'shape': (1,1,1)}"), "at byte 20");
  const std::string int64 = of_dictionary("{'descr': '<i8', 'fortran_order': False, 'shape': (1,1,1)}");
  expect_mentions(int64, "has the type \"<i8\" at byte 20");
  EXPECT_EQ(int64.find("damaged"), std::string::npos) << int64;
  expect_mentions(of_dictionary("{'descr': '<f4', 'fortran_order': Maybe, 'shape': (1,1,1)}"),
                  "True or False");
  expect_mentions(of_dictionary("{'descr': '<f4', 'fortran_order': False, 'shape': (1,1)}"),
                  "an array of 2 axes");
  expect_mentions(of_dictionary("{'descr': '<f4', 'fortran_order': False, 'shape': (1,1,1,2)}"), "of 4 axes");
  expect_mentions(of_dictionary("{'descr': '<f4', 'fortran_order': False, 'shape': (1,0,1)}"), "a size of 0");
  expect_mentions(of_dictionary("{'descr': '<f4', 'fortran_order': False, 'shape': (1,1,2)}"), "cut short");
  expect_mentions(of_dictionary("{'descr': '<f4', 'fortran_order': False, 'shape': (1,1,1)}", "12345"),
                  "1 bytes after its 1 samples");
  expect_mentions(
      of_dictionary("{'descr': '<f4', 'fortran_order': False, 'shape': (1000000000,1000000000,1000000000)}"),
      "cut short");
  expect_mentions(of_dictionary("{'descr': '<f4', 'fortran_order': False, "
                                "'shape': (99999999999999999999999,1,1)}"),
                  "expected a size");
}

TEST_F(DenseFiles, npy_survives_any_changed_byte_of_its_header) {
  const std::string whole =
      npy_bytes("{'descr': '<f4', 'fortran_order': False, 'shape': (1, 1, 2), }", "12345678");
  for (size_t place = 0; place < whole.size() - 8; ++place) {
    for (const int flip : {1, 16, 128}) {
      std::string bytes = whole;
      bytes[place] = char(bytes[place] ^ flip);
      error_of([&] { read_npy(write("a.npy", bytes)); });  // an Error or none: no other exception, no crash
    }
  }
}

// --- .raw and the header ---

TEST_F(DenseFiles, raw_keeps_every_bit) {
  const DenseVolume volume = random_volume({3, 4, 5}, 3);
  write_raw(folder / "a.raw", volume);
  const DenseVolume back = read_raw(folder / "a.raw");
  EXPECT_EQ(back.samples, volume.samples);
  EXPECT_EQ(back.header.grid, "smoke");
  EXPECT_EQ(read_file(folder / "a.raw").size(), 3u * 4 * 5 * 3 * 4) << "samples and nothing else";
}

TEST_F(DenseFiles, raw_reads_what_others_wrote) {
  write("a.raw.json", R"({"pileus_volume": 1, "type": "uint16", "endian": "big", "order": "z fastest",
                          "size": [2, 1, 3]})");
  const DenseVolume volume = read_raw(write("a.raw", std::string("\0\1\0\2\0\3\0\4\0\5\1\0", 12)));
  EXPECT_EQ(at(volume, 0, 0, 2), 3.0f);
  EXPECT_EQ(at(volume, 1, 0, 0), 4.0f);
  EXPECT_EQ(at(volume, 1, 0, 2), 256.0f);
}

TEST_F(DenseFiles, raw_without_a_header_is_refused) {
  expect_mentions(error_of([&] { read_raw(write("a.raw", "12345678")); }),
                  "expected their size and type in a.raw.json");
}

TEST_F(DenseFiles, a_header_answers_with_its_own_name_for_its_mistakes) {
  const auto refusal = [&](const std::string& header) {
    write("a.raw.json", header);
    return error_of([&] { read_raw(write("a.raw", "1234")); });
  };
  const std::string head = R"({"pileus_volume": 1, "size": [1, 1, 1])";
  EXPECT_EQ(refusal(head + "}"), "");
  expect_mentions(refusal(head), "a.raw.json: error: is not JSON (byte 39)");
  expect_mentions(refusal("[]"), "is no JSON object");
  expect_mentions(refusal(R"({"size": [1, 1, 1]})"), "expected \"pileus_volume\": 1");
  expect_mentions(refusal(R"({"pileus_volume": 2})"),
                  "pileus_volume = 2; expected a whole number from 1 to 1");
  expect_mentions(refusal(head + R"(, "typ": "float32"})"), "unknown key \"typ\"");
  expect_mentions(refusal(head + R"(, "typ": "float32"})"), "nearest: type");
  expect_mentions(refusal(head + R"(, "type": "float31"})"), "unknown type \"float31\"; expected uint8");
  expect_mentions(refusal(head + R"(, "class": "sphere"})"),
                  "class = \"sphere\"; expected fog volume, level set");
  expect_mentions(refusal(head + R"(, "first_voxel": [0, 0.5, 0]})"), "expected a whole number");
  expect_mentions(refusal(head + R"(, "world_from_index": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]})"),
                  "a list of 4");
  expect_mentions(refusal(head + R"(, "background": 1e999})"), "a number beyond all floats");
  expect_mentions(refusal(head + R"(, "crc32": 1})"), "has the checksum of other contents than a.raw's");
  expect_mentions(refusal(R"({"pileus_volume": 1, "size": [1, 1, 2]})"), "cut short");
  expect_mentions(refusal(R"({"pileus_volume": 1, "size": [1000000000, 1000000000, 1000000000]})"),
                  "cut short");
  EXPECT_NE(refusal(std::string(1000, '[')), "") << "deep nesting must not exhaust the stack";
}

TEST_F(DenseFiles, a_header_of_another_file_is_noticed) {
  write_npy(folder / "a.npy", random_volume({2, 2, 2}));
  write_npy(folder / "b.npy", random_volume({2, 2, 3}));
  std::filesystem::copy_file(folder / "a.npy.json", folder / "b.npy.json",
                             std::filesystem::copy_options::overwrite_existing);
  expect_mentions(error_of([&] { read_npy(folder / "b.npy"); }), "speaks of 2 x 2 x 2 samples of 1 channels");
}

}  // namespace
}  // namespace pileus
