#include <algorithm>
#include <array>
#include <cmath>

#include "lib/core/error.h"
#include "vdb_io/dense/dense_files.h"
#include "vdb_io/dense/file_pair.h"
#include "vdb_io/file_cursor.h"

namespace pileus {
namespace {

constexpr uint64_t kLongest = 65535;  ///< samples along an axis

double largest_number(uint32_t bytes) {
  return double((uint64_t(1) << (8 * bytes)) - 1);
}

SampleType whole_number_type(uint32_t bytes) {
  return bytes == 1 ? SampleType::uint8 : bytes == 2 ? SampleType::uint16 : SampleType::uint32;
}

/// The file says nothing of its numbers' width: POV-Ray, too, takes it from the length.
uint32_t width_of_numbers(FileCursor& file, const Vec3i& size) {
  const uint64_t count = uint64_t(size.x) * uint64_t(size.y) * uint64_t(size.z);
  for (const uint32_t bytes : {1u, 2u, 4u}) {
    if (file.remaining() == count * bytes) return bytes;
  }
  file.fail(
      fmt::format("is damaged, cut short or no .df3 file: {} x {} x {} samples need {}, {} or {} bytes "
                  "after byte {}; found {}",
                  size.x, size.y, size.z, count, 2 * count, 4 * count, file.position(), file.remaining()));
}

Vec3i read_sizes(FileCursor& file) {
  Vec3i size;
  for (int axis = 0; axis < 3; ++axis) {
    const auto high = file.get<uint8_t>("the sizes"), low = file.get<uint8_t>("the sizes");
    size[axis] = high << 8 | low;
    if (size[axis] == 0) {
      file.fail(fmt::format("is no .df3 file: size {} at byte {} is 0", axis + 1, file.position() - 2));
    }
  }
  return size;
}

std::vector<float> scaled(const Samples& whole, double scale, double largest) {
  return std::visit(
      [&](const auto& numbers) {
        std::vector<float> values(numbers.size());
        for (size_t i = 0; i < numbers.size(); ++i) {
          values[i] = float(scale * (double(numbers[i]) / largest));
        }
        return values;
      },
      whole);
}

/// The largest value, having refused what whole numbers cannot tell.
double checked_maximum(const std::filesystem::path& path, const DenseVolume& volume) {
  const auto fail = [&](const std::string& found) {
    throw Error(ErrorKind::file, path.string(),
                fmt::format("grid \"{}\" {}; a .df3 file holds densities >= 0 of one channel and nothing "
                            "around them; choose another grid or format",
                            volume.header.grid, found));
  };
  if (volume.channels != 1) fail("holds vectors");
  if (volume.header.background != 0.0) fail(fmt::format("has the background {}", volume.header.background));
  double largest = 0.0;
  std::visit(
      [&](const auto& values) {
        for (const auto value : values) {
          if (!(value >= 0) || std::isinf(value)) fail(fmt::format("holds the value {}", value));
          largest = std::max(largest, double(value));
        }
      },
      volume.samples);
  return largest;
}

void append_number(std::string& bytes, uint64_t number, uint32_t width) {
  for (uint32_t byte = width; byte-- > 0;) bytes += char(number >> (8 * byte) & 0xff);
}

/// Where POV-Ray, whose z axis points the other way, has to put the unit cube that it fills with the samples.
std::string pov_pattern(const std::filesystem::path& path, const VolumeHeader& header, const Vec3i& size) {
  const auto row = [](const Vec3d& v) { return fmt::format("{}, {}, {}", v.x, v.y, -v.z); };
  const Affine& to_world = header.world_from_index;
  const Vec3d first(header.first_voxel.x, header.first_voxel.y, header.first_voxel.z);
  return fmt::format("density_file df3 \"{}\" interpolate 1 matrix <{}, {}, {}, {}>",
                     path.filename().string(), row(to_world.direction({double(size.x), 0, 0})),
                     row(to_world.direction({0, double(size.y), 0})),
                     row(to_world.direction({0, 0, double(size.z)})), row(to_world.point(first)));
}

/// Sizes and numbers as the file has them, a layer of zeros in front of each axis.
std::string file_bytes(const DenseVolume& volume, const Vec3i& size, uint32_t width, double scale) {
  std::string bytes;
  bytes.reserve(6 + size_t(size.x) * size_t(size.y) * size_t(size.z) * width);
  for (int axis = 0; axis < 3; ++axis) append_number(bytes, uint64_t(size[axis]), 2);
  const double largest = largest_number(width);
  std::visit(
      [&](const auto& values) {
        size_t n = 0;
        for (int k = 0; k < size.z; ++k) {
          for (int j = 0; j < size.y; ++j) {
            for (int i = 0; i < size.x; ++i) {
              const bool is_border = i == 0 || j == 0 || k == 0;
              const double share = is_border ? 0.0 : double(values[n++]) / scale;
              append_number(bytes, uint64_t(std::llround(share * largest)), width);
            }
          }
        }
      },
      volume.samples);
  return bytes;
}

}  // namespace

DenseVolume read_df3(const std::filesystem::path& path, DenseRead what) {
  FileCursor file(path);
  if (file.size() < 6)
    file.fail(fmt::format("is no .df3 file: {} bytes, its sizes alone are 6", file.size()));
  DenseVolume volume;
  volume.size = read_sizes(file);
  const uint32_t width = width_of_numbers(file, volume.size);
  volume.stored = whole_number_type(width);
  if (const auto header = read_volume_header(path)) {
    check_header_fits(path, *header, volume.size, 1, what == DenseRead::all);
    volume.header = *header;
  } else {
    volume.header.world_from_index =
        Affine::scaling({1.0 / volume.size.x, 1.0 / volume.size.y, 1.0 / volume.size.z});
  }
  if (what == DenseRead::head) return volume;
  const Samples whole = read_samples(file, volume.stored, /*big_endian=*/true, file.remaining() / width);
  volume.samples = scaled(whole, volume.header.value_scale.value_or(1.0), largest_number(width));
  return volume;
}

void write_df3(const std::filesystem::path& path, const DenseVolume& volume, int bits) {
  if (bits != 8 && bits != 16 && bits != 32) {
    throw Error(ErrorKind::usage, SourceLoc{}, fmt::format("{} bits; a .df3 file has 8, 16 or 32", bits));
  }
  const double largest = checked_maximum(path, volume);
  const Vec3i size = volume.size + Vec3i(1);
  for (int axis = 0; axis < 3; ++axis) {
    if (uint64_t(size[axis]) <= kLongest) continue;
    throw Error(ErrorKind::file, path.string(),
                fmt::format("{} voxels along an axis; a .df3 file has {} at most; resample or crop",
                            volume.size[axis], kLongest - 1));
  }
  VolumeHeader header = volume.header;
  header.value_scale = largest > 0.0 ? largest : 1.0;
  header.type = name_of(whole_number_type(uint32_t(bits) / 8));
  header.big_endian = true;
  header.size = size;
  header.first_voxel = volume.header.first_voxel - Vec3i(1);
  write_with_header(path, file_bytes(volume, size, uint32_t(bits) / 8, *header.value_scale), header,
                    pov_pattern(path, header, size));
}

}  // namespace pileus
