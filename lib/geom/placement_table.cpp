#include "lib/geom/placement_table.h"

#include <cctype>
#include <charconv>
#include <cmath>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>

#include "lib/core/error.h"

namespace pileus {
namespace {

std::string_view trimmed(std::string_view text) {
  constexpr const char* kBlank = " \t\r";
  const size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::optional<double> as_number(std::string_view text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

TablePlace place_of(std::string_view line, const SourceLoc& loc) {
  std::vector<double> values;
  for (size_t start = 0; start <= line.size();) {
    const size_t end = std::min(line.find(',', start), line.size());
    const std::string_view field = trimmed(line.substr(start, end - start));
    const std::optional<double> value = as_number(field);
    if (!value)
      throw Error(ErrorKind::file, loc, fmt::format("found \"{}\"; expected a number", field.substr(0, 40)));
    values.push_back(*value);
    start = end + 1;
  }
  if (values.size() < 3 || values.size() > 5) {
    throw Error(
        ErrorKind::file, loc,
        fmt::format("found {} numbers; expected x,y,z or x,y,z,scale or x,y,z,scale,turn", values.size()));
  }
  TablePlace place{{values[0], values[1], values[2]}};
  if (values.size() > 3) place.scale = values[3];
  if (values.size() > 4) place.turn_deg = values[4];
  if (!(place.scale > 0.0))
    throw Error(ErrorKind::file, loc, fmt::format("scale = {}; expected > 0", place.scale));
  return place;
}

}  // namespace

std::vector<TablePlace> read_placement_table(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream) throw Error(ErrorKind::file, file.string(), "cannot be read");
  std::vector<TablePlace> places;
  std::string text;
  for (int number = 1; std::getline(stream, text); ++number) {
    const std::string_view line = trimmed(std::string_view(text).substr(0, text.find('#')));
    if (line.empty() || (number == 1 && std::isalpha(static_cast<unsigned char>(line.front())))) continue;
    places.push_back(place_of(line, {file.string(), number}));
  }
  if (stream.bad()) throw Error(ErrorKind::file, file.string(), "cannot be read to its end");
  if (places.empty())
    throw Error(ErrorKind::file, file.string(), "holds no places; expected lines x,y,z,scale,turn");
  return places;
}

}  // namespace pileus
