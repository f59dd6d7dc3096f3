#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "lib/math/vec.h"
#include "vdb_io/dense/volume_header.h"

namespace pileus {

class FileCursor;

/// A number as dense files store it.
enum class SampleType { uint8, int8, uint16, int16, uint32, int32, float16, float32, float64 };

/// "uint8", "float32", …: as NumPy and the headers of pileus spell it.
const char* name_of(SampleType type);
uint32_t bytes_of(SampleType type);
/// Throws Error(usage) that lists what there is.
SampleType sample_type_named(const std::string& name);

/// Samples in memory: float where it holds every value of the stored type, double elsewhere.
using Samples = std::variant<std::vector<float>, std::vector<double>>;

/// A box of samples, one per voxel: what .df3, .npy and .raw files hold.
struct DenseVolume {
  Vec3i size{0, 0, 0};                      ///< voxels along x, y, z
  int channels = 1;                         ///< 3 for vectors and colours
  Samples samples;                          ///< x fastest, the channels of a voxel side by side
  SampleType stored = SampleType::float32;  ///< how the file has, or shall have, them
  VolumeHeader header;                      ///< name, class, place in space
};

/// Reads `count` numbers where the cursor stands; the count has been checked against the file's size by
/// then, since nothing is allocated for numbers that are not there.
/// errors: Error(file) where fewer are left
Samples read_samples(FileCursor& file, SampleType type, bool big_endian, uint64_t count);

/// The product of sizes, or Error(file) of the cursor where one is < 1, or where the product with `bytes`
/// exceeds the rest of the file: what a header claims before anything is allocated.
uint64_t checked_count(FileCursor& file, const std::vector<uint64_t>& sizes, uint32_t bytes);

/// Where a sample stands in a file: the step from a sample to its neighbour along each axis, in samples.
struct SampleSteps {
  uint64_t x = 1, y = 1, z = 1, channel = 1;
};

/// Puts the samples of a file into the order of DenseVolume.
Samples arranged(Samples in_file, const Vec3i& size, int channels, const SampleSteps& steps);

/// The samples as `type` stores them, least byte first. Values must fit: that is the caller's business.
std::string stored_bytes(const Samples& samples, SampleType type);

}  // namespace pileus
