#pragma once

#include <optional>
#include <string>

namespace pileus {

/// What GeoTIFF says beside the pixels.
struct GeoTags {
  std::optional<double> scale_x, scale_y;  ///< size of a pixel, in units of the model
  std::optional<double> north;    ///< of the first tie point: of the upper edge, or the first row's centre
  bool is_geographic = false;     ///< the units are degrees
  std::optional<double> no_data;  ///< GDAL's: what stands where nothing is known
};

/// Reads the tags of the first directory of a TIFF file's bytes (classic or BigTIFF, either byte order). Tags
/// that are damaged or lie outside of the file count as missing: the pixels are not theirs to judge.
/// ref: OGC 19-008r4 (GeoTIFF 1.1)
GeoTags read_geo_tags(const std::string& bytes);

}  // namespace pileus
