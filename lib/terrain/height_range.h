#pragma once

#include <algorithm>
#include <limits>

namespace pileus {

/// Least and greatest height of a part of the surface; empty (least > greatest) where there is none.
struct HeightRange {
  float least = std::numeric_limits<float>::infinity();
  float greatest = -std::numeric_limits<float>::infinity();

  bool empty() const { return !(least <= greatest); }
  void extend(float z) { least = std::min(least, z), greatest = std::max(greatest, z); }
  void extend(const HeightRange& other) {
    least = std::min(least, other.least), greatest = std::max(greatest, other.greatest);
  }
};

}  // namespace pileus
