#include "vdb_io/dense/volume_header.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <vector>

#include <nlohmann/json.hpp>
#include <zlib.h>

#include "lib/core/error.h"
#include "vdb_io/file_cursor.h"

namespace pileus {
namespace {

using nlohmann::json;

constexpr int kVersion = 1;
constexpr uint64_t kLongestHeader = 1 << 20;  // [bytes]

/// The keys of a header file, each taken at most once, each checked for its type.
class HeaderKeys {
 public:
  HeaderKeys(std::filesystem::path path, const json& object) : m_path(std::move(path)), m_object(object) {}

  [[noreturn]] void fail(const std::string& message) const {
    throw Error(ErrorKind::file, m_path.string(), message);
  }

  const json* find(const char* key) {
    m_known.insert(key);
    const auto found = m_object.find(key);
    return found == m_object.end() ? nullptr : &*found;
  }

  void text(const char* key, std::string& target, const std::vector<std::string>& choices = {}) {
    const json* value = find(key);
    if (!value) return;
    if (!value->is_string()) wrong(key, *value, "a text");
    target = value->get<std::string>();
    if (!choices.empty() && std::count(choices.begin(), choices.end(), target) == 0) {
      wrong(key, *value, join_or(choices));
    }
  }

  double number_in(const char* key, const json& value) const {
    if (!value.is_number()) wrong(key, value, "a number");
    const double number = value.get<double>();
    if (!std::isfinite(number)) wrong(key, value, "a finite number");
    return number;
  }

  int64_t integer_in(const char* key, const json& value, int64_t least, int64_t most) const {
    const double number = number_in(key, value);
    if (std::floor(number) != number || number < double(least) || number > double(most)) {
      wrong(key, value, fmt::format("a whole number from {} to {}", least, most));
    }
    return int64_t(number);
  }

  const json& array_in(const char* key, const json& value, size_t count) const {
    if (!value.is_array() || value.size() != count) wrong(key, value, fmt::format("a list of {}", count));
    return value;
  }

  std::optional<Vec3i> triple(const char* key, int64_t least, int64_t most) {
    const json* value = find(key);
    if (!value) return std::nullopt;
    array_in(key, *value, 3);
    Vec3i result;
    for (int axis = 0; axis < 3; ++axis) {
      result[axis] = int(integer_in(key, (*value)[size_t(axis)], least, most));
    }
    return result;
  }

  void refuse_unknown() const {
    for (const auto& item : m_object.items()) {
      if (m_known.count(item.key()) > 0) continue;
      const std::vector<std::string> known(m_known.begin(), m_known.end());
      const std::string nearest = nearest_name(item.key(), known);
      fail(fmt::format("unknown key \"{}\"; expected {}{}", item.key(), join_or(known),
                       nearest.empty() ? "" : "; nearest: " + nearest));
    }
  }

 private:
  [[noreturn]] void wrong(const char* key, const json& value, const std::string& expected) const {
    std::string found = value.dump(-1, ' ', false, json::error_handler_t::replace);
    if (found.size() > 60) found = found.substr(0, 60) + "…";
    fail(fmt::format("{} = {}; expected {}", key, found, expected));
  }

  std::filesystem::path m_path;
  const json& m_object;
  std::set<std::string> m_known;
};

json parse(const std::filesystem::path& path) {
  FileCursor file(path);
  if (file.size() > kLongestHeader) {
    file.fail(fmt::format("has {} bytes; expected a header of {} at most", file.size(), kLongestHeader));
  }
  std::string text(file.size(), '\0');
  file.read(text.data(), text.size(), "the header");
  try {
    json object = json::parse(text);
    if (!object.is_object()) file.fail("is no JSON object; expected { \"pileus_volume\": 1, … }");
    return object;
  } catch (const json::parse_error& problem) {
    file.fail(fmt::format("is not JSON (byte {}); repair it, or delete it to go without", problem.byte));
  } catch (const json::out_of_range&) {
    file.fail("holds a number beyond all floats; expected finite ones");
  }
}

/// Rows of the matrix in column notation: p_world = A p_index + b, [A | b].
Affine matrix_in(const HeaderKeys& keys, const char* key, const json& value) {
  keys.array_in(key, value, 3);
  Imath::M44d matrix;
  for (size_t row = 0; row < 3; ++row) {
    keys.array_in(key, value[row], 4);
    for (size_t column = 0; column < 4; ++column) {
      matrix[int(column)][int(row)] = keys.number_in(key, value[row][column]);
    }
  }
  const Affine affine(matrix);
  const double volume = std::abs(affine.determinant());
  double edges = 1.0;
  for (int axis = 0; axis < 3; ++axis)
    edges *= Vec3d(matrix[axis][0], matrix[axis][1], matrix[axis][2]).length();
  if (!std::isnormal(volume) || !std::isfinite(edges) || !(volume > 1e-12 * edges)) {
    keys.fail(fmt::format("{} cannot be inverted; expected three independent axes", key));
  }
  return affine;
}

json matrix_rows(const Affine& affine) {
  json rows = json::array();
  for (int row = 0; row < 3; ++row) {
    const auto& m = affine.matrix();
    rows.push_back({m[0][row], m[1][row], m[2][row], m[3][row]});
  }
  return rows;
}

}  // namespace

std::filesystem::path header_path(const std::filesystem::path& data) {
  return data.string() + ".json";
}

std::optional<VolumeHeader> read_volume_header(const std::filesystem::path& data) {
  const std::filesystem::path path = header_path(data);
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return std::nullopt;
  const json object = parse(path);
  HeaderKeys keys(path, object);
  const json* version = keys.find("pileus_volume");
  if (!version) keys.fail("is no header of a volume; expected \"pileus_volume\": 1");
  keys.integer_in("pileus_volume", *version, 1, kVersion);

  VolumeHeader header;
  constexpr int kFar = 1 << 30;
  std::string endian = "little", order = "x fastest", crc, ignored_text;
  keys.text("grid", header.grid);
  keys.text("class", header.grid_class, {"fog volume", "level set", "staggered", "unknown"});
  if (const json* value = keys.find("background")) header.background = keys.number_in("background", *value);
  header.first_voxel = keys.triple("first_voxel", -kFar, kFar).value_or(Vec3i(0));
  if (const json* value = keys.find("world_from_index")) {
    header.world_from_index = matrix_in(keys, "world_from_index", *value);
  }
  if (const json* value = keys.find("value_scale")) {
    header.value_scale = keys.number_in("value_scale", *value);
  }
  keys.text("type", header.type);
  keys.text("endian", endian, {"little", "big"});
  keys.text("order", order, {"x fastest", "z fastest"});
  header.big_endian = endian == "big";
  header.z_fastest = order == "z fastest";
  header.size = keys.triple("size", 1, kFar);
  if (const json* value = keys.find("channels")) {
    header.channels = int(keys.integer_in("channels", *value, 1, 3));
    if (header.channels == 2) keys.fail("channels = 2; expected 1 or 3");
  }
  if (const json* value = keys.find("crc32")) {
    header.crc32 = uint32_t(keys.integer_in("crc32", *value, 0, 0xffffffff));
  }
  keys.text("data", ignored_text);
  keys.text("pov", ignored_text);
  keys.refuse_unknown();
  return header;
}

void check_header_fits(const std::filesystem::path& data, const VolumeHeader& header, const Vec3i& size,
                       int channels, bool with_checksum) {
  const std::string name = header_path(data).string();
  const std::string remedy = "it belongs to another file: delete it, or write both again";
  if ((header.size && *header.size != size) || header.channels != channels) {
    const Vec3i claimed = header.size.value_or(size);
    throw Error(ErrorKind::file, name,
                fmt::format("speaks of {} x {} x {} samples of {} channels, {} has {} x {} x {} of {}; {}",
                            claimed.x, claimed.y, claimed.z, header.channels, data.filename().string(),
                            size.x, size.y, size.z, channels, remedy));
  }
  if (with_checksum && header.crc32 && *header.crc32 != crc32_of_file(data)) {
    throw Error(
        ErrorKind::file, name,
        fmt::format("has the checksum of other contents than {}'s; {}", data.filename().string(), remedy));
  }
}

std::string header_text(const std::filesystem::path& data, const VolumeHeader& header,
                        const std::string& pov_pattern) {
  const auto triple = [](const Vec3i& v) { return json{v.x, v.y, v.z}; };
  nlohmann::ordered_json object{{"pileus_volume", kVersion},
                                {"data", data.filename().string()},
                                {"grid", header.grid},
                                {"class", header.grid_class},
                                {"background", header.background},
                                {"type", header.type},
                                {"endian", header.big_endian ? "big" : "little"},
                                {"order", header.z_fastest ? "z fastest" : "x fastest"},
                                {"channels", header.channels},
                                {"first_voxel", triple(header.first_voxel)},
                                {"world_from_index", matrix_rows(header.world_from_index)}};
  if (header.size) object["size"] = triple(*header.size);
  if (header.value_scale) object["value_scale"] = *header.value_scale;
  if (header.crc32) object["crc32"] = *header.crc32;
  if (!pov_pattern.empty()) object["pov"] = pov_pattern;
  return object.dump(1, ' ', false, json::error_handler_t::replace) + "\n";
}

uint32_t crc32_of_file(const std::filesystem::path& path) {
  FileCursor file(path);
  std::array<unsigned char, 1 << 16> buffer;
  uLong crc = ::crc32(0, nullptr, 0);
  while (file.remaining() > 0) {
    const size_t n = std::min<uint64_t>(buffer.size(), file.remaining());
    file.read(buffer.data(), n, "the data");
    crc = ::crc32(crc, buffer.data(), uInt(n));
  }
  return uint32_t(crc);
}

}  // namespace pileus
