#include "lib/image/png_filter.h"

#include <cstdlib>

namespace pileus {
namespace {

/// That of the three neighbours which is nearest to left + above - corner.
int paeth(int left, int above, int corner) {
  const int to_left = std::abs(above - corner), to_above = std::abs(left - corner),
            to_corner = std::abs(left + above - 2 * corner);
  if (to_left <= to_above && to_left <= to_corner) return left;
  return to_above <= to_corner ? above : corner;
}

/// predict(left, above, corner) is what was subtracted; beside the row there are zeros.
template <size_t kPixel, class Predict>
void add(const uint8_t* above, uint8_t* row, size_t count, Predict&& predict) {
  int left[kPixel]{}, corner[kPixel]{};
  for (size_t at = 0; at + kPixel <= count; at += kPixel) {
    for (size_t byte = 0; byte < kPixel; ++byte) {
      const int up = above[at + byte];
      left[byte] = uint8_t(row[at + byte] + predict(left[byte], up, corner[byte]));
      corner[byte] = up;
      row[at + byte] = uint8_t(left[byte]);
    }
  }
}

template <size_t kPixel>
bool undo(int filter, const uint8_t* above, uint8_t* row, size_t count) {
  switch (filter) {
    case 0:
      return true;
    case 1:
      add<kPixel>(above, row, count, [](int left, int, int) { return left; });
      return true;
    case 2:
      for (size_t at = 0; at < count; ++at) row[at] = uint8_t(row[at] + above[at]);
      return true;
    case 3:
      add<kPixel>(above, row, count, [](int left, int up, int) { return (left + up) / 2; });
      return true;
    case 4:
      add<kPixel>(above, row, count, paeth);
      return true;
    default:
      return false;
  }
}

}  // namespace

bool undo_png_filter(int filter, size_t pixel, const uint8_t* above, uint8_t* row, size_t count) {
  return pixel == 2 ? undo<2>(filter, above, row, count) : undo<1>(filter, above, row, count);
}

}  // namespace pileus
