#include "lib/terrain/elevation_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <map>
#include <numbers>
#include <optional>
#include <regex>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

#include "lib/core/error.h"
#include "lib/core/memory_budget.h"
#include "lib/core/parallel.h"
#include "lib/image/read_numbers.h"
#include "lib/terrain/geo_tags.h"

namespace pileus {
namespace {

namespace fs = std::filesystem;

constexpr float kNoData = std::numeric_limits<float>::quiet_NaN();

[[noreturn]] void refuse(const fs::path& file, const std::string& message) {
  throw Error(ErrorKind::file, file.string(), message);
}

/// A file that any thread may read a part of.
class OpenFile {
 public:
  explicit OpenFile(const fs::path& file)
      : m_file(file), m_descriptor(open(file.c_str(), O_RDONLY | O_CLOEXEC)) {
    std::error_code error;
    if (fs::is_regular_file(file, error)) m_size = fs::file_size(file, error);
    if (m_size == 0 || error || m_descriptor < 0) {
      if (m_descriptor >= 0) close(m_descriptor);
      refuse(file, "is missing, empty or cannot be read; expected a file of heights");
    }
  }
  ~OpenFile() { close(m_descriptor); }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  uint64_t size() const { return m_size; }

  void read(uint64_t at, char* to, size_t count) const {
    while (count > 0) {
      const ssize_t got = pread(m_descriptor, to, count, off_t(at));
      if (got <= 0) refuse(m_file, "cannot be read");
      to += got, at += uint64_t(got), count -= size_t(got);
    }
  }

 private:
  const fs::path& m_file;
  int m_descriptor;
  uint64_t m_size = 0;
};

std::string read_bytes(const fs::path& file) {
  const OpenFile open_file(file);
  if (open_file.size() > memory_budget()) {
    refuse(file, fmt::format("has {}; expected at most {}", bytes_text(open_file.size()),
                             bytes_text(memory_budget())));
  }
  std::string bytes(open_file.size(), '\0');
  open_file.read(0, bytes.data(), bytes.size());
  return bytes;
}

/// Calls body(first, end) for stretches of `count` items, on all cores.
template <class Body>
void for_stretches(size_t count, Body&& body) {
  constexpr size_t kItems = size_t(1) << 18;
  parallel_for((count + kItems - 1) / kItems,
               [&](size_t part) { body(part * kItems, std::min(count, (part + 1) * kItems)); });
}

void mark_no_data(HeightTable& table, std::optional<double> no_data) {
  const float mark = no_data ? float(*no_data) : kNoData;
  for_stretches(table.heights.size(), [&](size_t first, size_t end) {
    const auto is_missing = [&](float z) {
      return z == mark || !(std::abs(z) <= std::numeric_limits<float>::max());
    };
    float* const heights = table.heights.data();
    int missing = 0;  // most tables have none, and are only looked through
    for (size_t k = first; k < end; ++k) missing |= int(is_missing(heights[k]));
    if (missing != 0) std::replace_if(heights + first, heights + end, is_missing, kNoData);
  });
}

void set_degrees(HeightTable& table, double cell_x_deg, double cell_y_deg, double middle_latitude) {
  const DegreeLengths metres = degree_lengths(middle_latitude);
  table.cell_x = cell_x_deg * metres.east;
  table.cell_y = cell_y_deg * metres.north;
}

HeightTable from_plane(const fs::path& file) {
  NumberPlane plane = read_number_plane(file);
  check_table_size(file, plane.width, plane.height);
  return HeightTable{plane.width, plane.height, std::move(plane.values)};
}

HeightTable read_geotiff(const fs::path& file) {
  const GeoTags tags = read_geo_tags(read_bytes(file));
  HeightTable table = from_plane(file);
  mark_no_data(table, tags.no_data);
  if (!tags.scale_x) return table;
  if (!tags.is_geographic) {
    table.cell_x = *tags.scale_x, table.cell_y = *tags.scale_y;
    return table;
  }
  const double latitude = tags.north.value_or(0.0) - 0.5 * *tags.scale_y * table.rows;
  if (!(std::abs(latitude) < 90.0)) refuse(file, fmt::format("lies at latitude {}", latitude));
  set_degrees(table, *tags.scale_x, *tags.scale_y, latitude);
  return table;
}

HeightTable read_hgt(const fs::path& file) {
  const std::string name = file.filename().string();
  std::smatch match;
  if (!std::regex_match(name, match, std::regex("([NSns])([0-9]{2})[EWew][0-9]{3}.*"))) {
    refuse(file, "does not tell its place; expected a name such as N46E007.hgt");
  }
  const std::string bytes = read_bytes(file);
  const auto side = uint64_t(std::lround(std::sqrt(double(bytes.size() / 2))));
  if (side < 2 || side * side * 2 != bytes.size()) {
    refuse(file,
           fmt::format("has {} bytes; expected a square of 16-bit heights, such as 1201 x 1201 (2884802 "
                       "bytes) or 3601 x 3601",
                       bytes.size()));
  }
  check_table_size(file, int64_t(side), int64_t(side));
  HeightTable table{int(side), int(side), HeightValues(side * side)};
  for (size_t k = 0; k < table.heights.size(); ++k) {
    const auto high = static_cast<unsigned char>(bytes[2 * k]),
               low = static_cast<unsigned char>(bytes[2 * k + 1]);
    table.heights[k] = float(int16_t(uint16_t(high << 8 | low)));
  }
  mark_no_data(table, -32768.0);
  const double south = std::stod(match[2]) * (std::toupper(match[1].str()[0]) == 'S' ? -1.0 : 1.0);
  set_degrees(table, 1.0 / double(side - 1), 1.0 / double(side - 1), south + 0.5);
  return table;
}

/// Words of a text, with the line they stand in.
class Words {
 public:
  Words(const fs::path& file, std::string_view text) : m_file(file), m_text(text) {}

  bool at_end() {
    skip_space();
    return m_at == m_text.size();
  }
  std::string_view next() {
    skip_space();
    const size_t begin = m_at;
    while (m_at < m_text.size() && !is_space(m_text[m_at])) ++m_at;
    return m_text.substr(begin, m_at - begin);
  }
  bool starts_name() {
    skip_space();
    return m_at < m_text.size() && std::isalpha(static_cast<unsigned char>(m_text[m_at])) != 0 &&
           m_text.substr(m_at, 3) != "nan" && m_text.substr(m_at, 3) != "NaN";
  }
  double number() {
    const std::string_view word = next();
    double value = 0.0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (word.empty()) fail("ends too early; expected a number");
    if (error != std::errc() || end != word.data() + word.size()) {
      fail(fmt::format("\"{}\" is no number", word.substr(0, 24)));
    }
    return value;
  }
  [[noreturn]] void fail(const std::string& message) const {
    throw Error(ErrorKind::file, SourceLoc{m_file.string(), m_line, 0}, message);
  }

 private:
  static bool is_space(char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }
  void skip_space() {
    while (m_at < m_text.size() && is_space(m_text[m_at])) m_line += m_text[m_at++] == '\n' ? 1 : 0;
  }

  const fs::path& m_file;
  std::string_view m_text;
  size_t m_at = 0;
  int m_line = 1;
};

std::map<std::string, double> read_ascii_header(Words& words) {
  static const std::vector<std::string> kNames{"ncols",     "nrows",       "xllcorner", "yllcorner",
                                               "xllcenter", "yllcenter",   "cellsize",  "dx",
                                               "dy",        "nodata_value"};
  std::map<std::string, double> header;
  while (words.starts_name()) {
    std::string name(words.next());
    std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
    if (std::find(kNames.begin(), kNames.end(), name) == kNames.end()) {
      words.fail(fmt::format("\"{}\" is no header of an ASCII grid; expected {}", name.substr(0, 24),
                             join_or(kNames)));
    }
    header[name] = words.number();
  }
  for (const char* name : {"ncols", "nrows"}) {
    const auto found = header.find(name);
    if (found == header.end()) words.fail(fmt::format("{} is missing", name));
    if (!(found->second >= 1.0 && found->second <= 1e9) || found->second != std::floor(found->second)) {
      words.fail(fmt::format("{} is {}; expected a whole number", name, found->second));
    }
  }
  return header;
}

HeightTable read_ascii(const fs::path& file) {
  const std::string text = read_bytes(file);
  Words words(file, text);
  std::map<std::string, double> header = read_ascii_header(words);
  const auto columns = int64_t(header["ncols"]), rows = int64_t(header["nrows"]);
  check_table_size(file, columns, rows);
  const uint64_t count = uint64_t(columns) * uint64_t(rows);
  if (count > text.size() / 2 + 1) {
    refuse(file, fmt::format("claims {} x {} heights in {} bytes", columns, rows, text.size()));
  }
  HeightTable table{int(columns), int(rows), HeightValues(count)};
  for (float& z : table.heights) z = float(words.number());
  if (!words.at_end()) words.fail("more numbers than ncols x nrows");
  mark_no_data(table, header.contains("nodata_value") ? header["nodata_value"] : -9999.0);

  const double cell = header.contains("cellsize") ? header["cellsize"] : 1.0;
  const double dx = header.contains("dx") ? header["dx"] : cell;
  const double dy = header.contains("dy") ? header["dy"] : cell;
  if (!(dx > 0.0 && dy > 0.0 && std::isfinite(dx) && std::isfinite(dy))) {
    refuse(file, fmt::format("has cells of {} x {}; expected sizes > 0", dx, dy));
  }
  const bool is_corner = header.contains("yllcorner");
  const double south = is_corner ? header["yllcorner"] : header["yllcenter"];
  const double west = header.contains("xllcorner") ? header["xllcorner"] : header["xllcenter"];
  const bool is_degrees = dx < 0.1 && dy < 0.1 && std::abs(west) <= 360.0 && south >= -90.0 &&
                          south + dy * double(rows) <= 90.0 + dy;
  table.cell_x = dx, table.cell_y = dy;
  if (is_degrees) set_degrees(table, dx, dy, south + 0.5 * dy * double(rows));
  return table;
}

double number_at(const std::string& bytes, size_t at, char kind, size_t size, bool is_big) {
  uint64_t raw = 0;
  for (size_t k = 0; k < size; ++k) {
    raw = raw << 8 | static_cast<unsigned char>(bytes[at + (is_big ? k : size - 1 - k)]);
  }
  if (kind == 'f')
    return size == 4 ? double(std::bit_cast<float>(uint32_t(raw))) : std::bit_cast<double>(raw);
  if (kind == 'u') return double(raw);
  const unsigned unused = unsigned(64 - 8 * size);
  return double(int64_t(raw << unused) >> unused);
}

using NumberCopy = void (*)(const char* from, float* to, size_t count);

template <class T>
void copy_numbers(const char* from, float* to, size_t count) {
  for (size_t k = 0; k < count; ++k) {
    T number;
    std::memcpy(&number, from + k * sizeof(T), sizeof(T));
    to[k] = float(double(number));
  }
}

/// Numbers of this machine as floats. kind: f, i or u; size [bytes]
NumberCopy number_copy(char kind, size_t size) {
  if (kind == 'f') return size == 4 ? copy_numbers<float> : copy_numbers<double>;
  const bool is_signed = kind == 'i';
  switch (size) {
    case 1:
      return is_signed ? copy_numbers<int8_t> : copy_numbers<uint8_t>;
    case 2:
      return is_signed ? copy_numbers<int16_t> : copy_numbers<uint16_t>;
    case 4:
      return is_signed ? copy_numbers<int32_t> : copy_numbers<uint32_t>;
    default:
      return is_signed ? copy_numbers<int64_t> : copy_numbers<uint64_t>;
  }
}

/// What the header of a .npy file says.
struct NpyForm {
  char kind = 'f';
  size_t size = 4;  ///< of a number [bytes]
  bool is_big = false, is_fortran = false;
  int64_t rows = 0, columns = 0;
  uint64_t start = 0;  ///< of the numbers in the file
};

NpyForm read_npy_form(const fs::path& file, const OpenFile& open_file) {
  constexpr size_t kLongest = 4096, kMostBefore = 12;
  std::string bytes(std::min<uint64_t>(open_file.size(), kLongest + kMostBefore), '\0');
  open_file.read(0, bytes.data(), bytes.size());
  if (bytes.size() < kMostBefore || !bytes.starts_with("\x93NUMPY")) refuse(file, "is no .npy file");
  const bool is_first_version = bytes[6] == 1;
  const size_t start = is_first_version ? 10 : kMostBefore;
  const auto byte = [&](size_t at) { return size_t(static_cast<unsigned char>(bytes[at])); };
  const size_t length = byte(8) | byte(9) << 8 | (is_first_version ? 0 : byte(10) << 16 | byte(11) << 24);
  if (length > kLongest || length > bytes.size() - start) refuse(file, "is cut short in its header");
  const std::string header = bytes.substr(start, length);
  static const std::regex kForm(
      "\\{'descr': '([<>|=])([fiu])([1248])', 'fortran_order': (True|False), "
      "'shape': \\(([0-9]{1,9}), ([0-9]{1,9})\\),? *\\} *\n?");
  std::smatch match;
  if (!std::regex_match(header, match, kForm)) {
    refuse(file, "is no array of two axes; expected array[row, column] of whole or floating numbers");
  }
  const NpyForm form{
      match[2].str()[0],   std::stoul(match[3]), match[1].str() == ">", match[4].str() == "True",
      std::stol(match[5]), std::stol(match[6]),  start + length};
  if (form.kind == 'f' && form.size < 4) refuse(file, "has 16-bit floats; expected <f4 or <f8");
  return form;
}

HeightTable read_npy(const fs::path& file) {
  const OpenFile open_file(file);
  const NpyForm form = read_npy_form(file, open_file);
  check_table_size(file, form.columns, form.rows);
  const uint64_t count = uint64_t(form.columns) * uint64_t(form.rows);
  if (open_file.size() - form.start != count * form.size) {
    refuse(file, fmt::format("has {} bytes of numbers; expected {}", open_file.size() - form.start,
                             count * form.size));
  }
  HeightTable table{int(form.columns), int(form.rows), HeightValues(count)};
  if (!form.is_big && !form.is_fortran && std::endian::native == std::endian::little) {
    const NumberCopy copy = number_copy(form.kind, form.size);
    for_stretches(count, [&](size_t first, size_t end) {
      std::array<char, 1 << 16> piece;  // stays in the cache
      const size_t numbers = piece.size() / form.size;
      for (size_t k = first; k < end; k += numbers) {
        const size_t here = std::min(numbers, end - k);
        open_file.read(form.start + k * form.size, piece.data(), here * form.size);
        copy(piece.data(), table.heights.data() + k, here);
      }
    });
    return table;
  }
  const std::string bytes = read_bytes(file);
  const auto rows = uint64_t(form.rows), columns = uint64_t(form.columns);
  for (uint64_t k = 0; k < count; ++k) {
    const uint64_t in_file = form.is_fortran ? k % columns * rows + k / columns : k;
    table.heights[k] =
        float(number_at(bytes, form.start + in_file * form.size, form.kind, form.size, form.is_big));
  }
  return table;
}

}  // namespace

DegreeLengths degree_lengths(double latitude_deg) {
  const double phi = latitude_deg * std::numbers::pi / 180.0;
  return {111412.84 * std::cos(phi) - 93.5 * std::cos(3.0 * phi) + 0.118 * std::cos(5.0 * phi),
          111132.954 - 559.822 * std::cos(2.0 * phi) + 1.175 * std::cos(4.0 * phi)};
}

HeightTable read_elevation(const fs::path& file) {
  using Reader = HeightTable (*)(const fs::path&);
  static const std::map<std::string, Reader> kReaders{
      {".tif", read_geotiff}, {".tiff", read_geotiff}, {".hgt", read_hgt},   {".asc", read_ascii},
      {".npy", read_npy},     {".exr", from_plane},    {".png", from_plane},
  };
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  const auto reader = kReaders.find(extension);
  if (reader == kReaders.end()) {
    std::vector<std::string> names;
    for (const auto& [name, function] : kReaders) names.push_back(name);
    refuse(file, fmt::format("the name ends in \"{}\"; expected {}", extension, join_or(names)));
  }
  HeightTable table = reader->second(file);
  mark_no_data(table, std::nullopt);
  const bool is_void =
      std::all_of(table.heights.begin(), table.heights.end(), [](float z) { return std::isnan(z); });
  if (is_void) refuse(file, "has no height at all: every node is without data");
  return table;
}

}  // namespace pileus
