#pragma once

#include <filesystem>

#include "lib/terrain/height_table.h"

namespace pileus {

/// Metres in a degree on the WGS 84 ellipsoid.
struct DegreeLengths {
  double east = 0.0, north = 0.0;
};

/// With the latitude phi:
///   north = 111132.954 - 559.822 cos 2 phi + 1.175 cos 4 phi
///   east  = 111412.84 cos phi - 93.5 cos 3 phi + 0.118 cos 5 phi
/// errors: below 0.02 m. ref: Snyder 1987, Map projections
DegreeLengths degree_lengths(double latitude_deg);

/// Reads a file of heights; its name tells the format:
///   .tif .tiff   GeoTIFF, one channel: size of pixels, degrees or metres, GDAL's no-data value
///   .hgt         SRTM: the name (N46E007) tells the latitude; -32768 is no data
///   .asc         ESRI ASCII grid, with its cell size and no-data value; in degrees if the numbers can only
///   be that .npy         NumPy, array[row, column]; nodes are 1 m apart .exr .png    one channel, whole
///   numbers as they are; nodes are 1 m apart
/// Degrees become metres at the latitude of the middle. NaN is no data; so is an infinite value.
/// errors: Error(file) where the file is missing, damaged, of another format, no table of heights, without
/// any
///         height, or larger than the memory budget allows
HeightTable read_elevation(const std::filesystem::path& file);

}  // namespace pileus
