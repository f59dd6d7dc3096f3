#pragma once

#include <cstddef>
#include <cstdint>

namespace pileus {

/// Undoes the filter of a row of a PNG file, in place: false for a filter that there is not.
///   filter           0 none, 1 left, 2 above, 3 mean of both, 4 Paeth's
///   pixel            bytes of a pixel: 1 or 2
///   above            the row above, undone; zeros for the first
/// ref: ISO/IEC 15948, 9.2
bool undo_png_filter(int filter, size_t pixel, const uint8_t* above, uint8_t* row, size_t count);

}  // namespace pileus
