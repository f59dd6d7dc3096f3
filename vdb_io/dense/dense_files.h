#pragma once

#include <filesystem>

#include "vdb_io/dense/samples.h"

namespace pileus {

// Files that hold a box of samples. Each reader takes one path and trusts nothing in it: sizes are held
// against the length of the file before anything is allocated. A JSON header beside the file
// (volume_header.h) tells the name, the class and the place of the samples; .raw files must have one.
// DenseRead::head leaves the samples out, and the checksum unchecked. errors of all: Error(file), one line
// that says what was found at which byte, and what was expected

enum class DenseRead { all, head };

/// POV-Ray's density file: three big-endian 16-bit sizes, then whole numbers of 8, 16 or 32 bits. Without a
/// header it fills the unit cube as POV-Ray shows it: sample i of S at i/S, its largest number for density 1.
DenseVolume read_df3(const std::filesystem::path& path, DenseRead what = DenseRead::all);

/// NumPy's array file, versions 1 to 3: whole or floating numbers, C or Fortran order, array[x, y, z] or
/// array[x, y, z, 3]. Without a header voxels are 1 m wide, the first at the origin.
DenseVolume read_npy(const std::filesystem::path& path, DenseRead what = DenseRead::all);

/// Samples and nothing else; the header tells type, endianness, order and sizes.
DenseVolume read_raw(const std::filesystem::path& path, DenseRead what = DenseRead::all);

/// POV-Ray shows sample i of S at i/S, takes sample 0 for its neighbour across the far edge, and shows
/// nothing outside the unit cube: one layer of zeros in front of each axis makes a border on both sides, and
/// puts every voxel's centre where it belongs. Values become whole numbers of 8, 16 or 32 bits, the largest
/// value the largest number; the header keeps that scale, and the transform for POV-Ray.
///   volume: one channel, values finite and >= 0, background 0; at most 65534 voxels along an axis
void write_df3(const std::filesystem::path& path, const DenseVolume& volume, int bits);

/// array[x, y, z] or array[x, y, z, 3] in C order, of the type `volume.stored`; its header beside it.
void write_npy(const std::filesystem::path& path, const DenseVolume& volume);

/// Samples of the type `volume.stored`, x fastest, least byte first; its header beside it.
void write_raw(const std::filesystem::path& path, const DenseVolume& volume);

}  // namespace pileus
