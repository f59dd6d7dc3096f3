#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>

namespace pileus {

/// Exactly `count` integers with a separator between them, such as "960x540"; none where the text is anything
/// else or a number does not fit an int.
template <size_t count>
std::optional<std::array<int, count>> parse_integers(std::string_view text, char separator) {
  std::array<int, count> numbers{};
  const char *at = text.data(), *end = text.data() + text.size();
  for (size_t i = 0; i < count; ++i) {
    if (i > 0 && (at == end || *at++ != separator)) return std::nullopt;
    const auto [rest, error] = std::from_chars(at, end, numbers[i]);
    if (error != std::errc()) return std::nullopt;
    at = rest;
  }
  return at == end ? std::optional(numbers) : std::nullopt;
}

/// Numbers above 0. CLI11's own PositiveNumber lets NaN and infinity pass.
inline CLI::Validator finite_positive() {
  const auto complaint = [](std::string& text) {
    double value = 0.0;
    const bool is_number = CLI::detail::lexical_cast(text, value);
    return is_number && std::isfinite(value) && value > 0.0 ? "" : text + " is no positive number";
  };
  return {complaint, "POSITIVE"};
}

}  // namespace pileus
