#pragma once

#include <cstdint>
#include <limits>

namespace pileus {

/// Values of a grid that a density must not have, active or not: interpolation sees both. A tile counts with
/// all its voxels.
struct ValueCounts {
  uint64_t nan = 0, infinite = 0, negative = 0;
  uint64_t inactive_nonzero = 0;
  double min = 0.0, max = 0.0;  ///< over the finite values of active voxels; 0 where there are none

  uint64_t bad() const { return nan + infinite + negative; }
  bool operator==(const ValueCounts&) const = default;
};

/// Counts under way.
class ValueTally {
 public:
  /// Some voxels of one value.
  void add(float value, bool is_active, uint64_t voxels);

  /// Whether a leaf holds zeros only; which bricks it reaches, and its largest value: as look_at_leaf says.
  struct Leaf {
    bool is_zero;
    uint8_t reached;
    float largest;
  };

  /// The 8^3 voxels of a leaf; `active` is its mask, 8 words.
  Leaf add_leaf(const float* values, const uint64_t* active);

  void add(const ValueTally& other);

  ValueCounts counts() const;

 private:
  ValueCounts m_counts;
  // Beyond every value where there is none.
  double m_min = std::numeric_limits<double>::infinity();
  double m_max = -std::numeric_limits<double>::infinity();
};

}  // namespace pileus
