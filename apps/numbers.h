#pragma once

#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <regex>
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

/// Finite numbers of either sign.
inline CLI::Validator finite() {
  const auto complaint = [](std::string& text) {
    double value = 0.0;
    return CLI::detail::lexical_cast(text, value) && std::isfinite(value) ? ""
                                                                          : text + " is no finite number";
  };
  return {complaint, "NUMBER"};
}

/// A number of bytes, with a unit or without: 500MB, 1.5 GiB, 2e9. K, M, G and T count in thousands, Ki, Mi,
/// Gi and Ti in 1024s. None where the text is anything else, or not from 1 byte to 2^50 bytes.
inline std::optional<int64_t> parse_bytes(const std::string& text) {
  static const std::regex form(R"(\s*([0-9.]+(?:[eE][+-]?[0-9]+)?)\s*([kKMGT]?)(i?)[bB]?\s*)");
  std::smatch match;
  if (!std::regex_match(text, match, form)) return std::nullopt;
  const std::string units = "KMGT";
  const bool has_unit = match[2].length() > 0, is_binary = match[3].length() > 0;
  if (is_binary && !has_unit) return std::nullopt;
  double bytes = 0.0;
  if (!CLI::detail::lexical_cast(match[1].str(), bytes)) return std::nullopt;
  if (has_unit) {
    const size_t power = units.find(char(std::toupper(match[2].str()[0]))) + 1;
    bytes *= std::pow(is_binary ? 1024.0 : 1000.0, double(power));
  }
  return 1 <= bytes && bytes <= 0x1p50 ? std::optional(int64_t(bytes)) : std::nullopt;
}

}  // namespace pileus
