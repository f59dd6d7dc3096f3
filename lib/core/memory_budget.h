#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace pileus {

/// How much memory one grid may take, as read and again as laid out for rendering [bytes]: half of what the
/// machine has (or of what its control group allows), until set_memory_budget says otherwise.
uint64_t memory_budget();

/// Sets the budget of the process; 0 means the default again. Call it before work begins.
void set_memory_budget(uint64_t bytes);

/// Refuses what would take more than the budget, before any of it is taken.
///   what: as in "grid \"density\""
/// errors: Error(file)
void require_memory(const std::string& file, const std::string& what, uint64_t bytes);

/// "512M", "1.5G", "2000000": bytes, with K, M, G or T for powers of 1000. Nothing for other texts.
std::optional<uint64_t> parse_bytes(const std::string& text);

/// The same number or a little more, in the shortest form that parse_bytes reads: "13G", "870M".
std::string bytes_option(uint64_t bytes);

/// "1.5 GB", "20 kB": three digits.
std::string bytes_text(uint64_t bytes);

}  // namespace pileus
