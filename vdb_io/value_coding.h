#pragma once

#include <cstdint>

namespace pileus {

// How the values of a node stand in a .vdb file: a byte of InactiveValues; up to two values; a mask where two
// inactive values are told apart; then the block: all values or only the active ones, packed or not.

/// Flags of a grid's compression.
inline constexpr uint32_t kZipped = 1, kActiveMask = 2, kBlosc = 4;

/// What inactive values are (the numbers are the file format's). Where the mask is set, they are the
/// background, or the second value; else minus the background, or the first value.
enum class InactiveValues : uint8_t {
  background = 0,
  minus_background = 1,
  one_value = 2,
  mask_of_signs = 3,
  mask_and_one_value = 4,
  mask_and_two_values = 5,
  all_stored = 6
};

/// Values that follow the byte.
inline int stored_inactive_values(InactiveValues kind) {
  if (kind == InactiveValues::mask_and_two_values) return 2;
  return kind == InactiveValues::one_value || kind == InactiveValues::mask_and_one_value ? 1 : 0;
}

/// True where a mask follows these.
inline bool has_inactive_mask(InactiveValues kind) {
  return kind >= InactiveValues::mask_of_signs && kind <= InactiveValues::mask_and_two_values;
}

/// True where the block holds the active values only.
inline bool has_only_active_values(InactiveValues kind, uint32_t compression) {
  return (compression & kActiveMask) != 0 && kind != InactiveValues::all_stored;
}

}  // namespace pileus
