#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace pileus {

struct ChildLimits {
  uint64_t memory_bytes;  ///< address space beyond what the program takes by itself
  unsigned cpu_seconds;   ///< processor time of all its threads
};

/// What fits reading a file of this size: the memory budget, and a minute and more of processor time.
ChildLimits limits_for_reading(uint64_t file_bytes);

/// How a child ended.
struct ChildEnd {
  int exit_code = 0;  ///< its own
  std::string death;  ///< why it did not end by itself: "crashes the reader (Segmentation fault)"; else ""
};

/// Splits the program in two before it touches a file that it does not trust. The child gets nothing back and
/// goes on as the program, under limits that make any excess its own end; the parent waits and learns how it
/// ended. Interrupts reach both. Call it before any parallel work begins, and with nothing to flush.
/// Where no child can be made, the program goes on by itself.
std::optional<ChildEnd> split_off_limited_child(const ChildLimits& limits);

}  // namespace pileus
