#include "vdb_io/value_counts.h"

#include <algorithm>
#include <cmath>

#include "lib/volume/kernels/leaf_kernels.h"

namespace pileus {

void ValueTally::add(float value, bool is_active, uint64_t voxels) {
  if (std::isnan(value)) {
    m_counts.nan += voxels;
  } else if (std::isinf(value)) {
    m_counts.infinite += voxels;
  } else {
    if (value < 0.0f) m_counts.negative += voxels;
    if (is_active) {
      m_min = std::min(m_min, double(value));
      m_max = std::max(m_max, double(value));
    }
  }
  if (!is_active && value != 0.0f) m_counts.inactive_nonzero += voxels;
}

ValueTally::Leaf ValueTally::add_leaf(const float* values, const uint64_t* active) {
  const LeafLook look = look_at_leaf(values, active);
  if (look.is_plain) {
    m_min = std::min(m_min, double(look.lowest_active));
    m_max = std::max(m_max, double(look.highest_active));
    m_counts.inactive_nonzero += look.inactive_nonzero;
  } else {
    for (int n = 0; n < 512; ++n) add(values[n], (active[n >> 6] >> (n & 63) & 1) != 0, 1);
  }
  return {look.is_plain && look.reached == 0, look.reached, look.largest};
}

void ValueTally::add(const ValueTally& other) {
  m_counts.nan += other.m_counts.nan;
  m_counts.infinite += other.m_counts.infinite;
  m_counts.negative += other.m_counts.negative;
  m_counts.inactive_nonzero += other.m_counts.inactive_nonzero;
  m_min = std::min(m_min, other.m_min);
  m_max = std::max(m_max, other.m_max);
}

ValueCounts ValueTally::counts() const {
  ValueCounts counts = m_counts;
  if (m_min <= m_max) {
    counts.min = m_min;
    counts.max = m_max;
  }
  return counts;
}

}  // namespace pileus
