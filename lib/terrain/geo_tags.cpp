#include "lib/terrain/geo_tags.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <vector>

namespace pileus {
namespace {

/// Bytes of a TIFF file; what lies beyond its end reads as 0.
class TiffBytes {
 public:
  explicit TiffBytes(const std::string& bytes)
      : m_bytes(bytes), m_is_little(bytes.starts_with("II")), m_is_big_tiff(number(2, 2) == 43) {}

  bool is_tiff() const {
    return (m_bytes.starts_with("II") || m_bytes.starts_with("MM")) && (number(2, 2) == 42 || m_is_big_tiff);
  }

  uint64_t number(uint64_t at, unsigned size) const {
    uint64_t value = 0;
    if (at > m_bytes.size() || m_bytes.size() - at < size) return 0;
    for (unsigned k = 0; k < size; ++k) {
      const auto byte = static_cast<unsigned char>(m_bytes[at + (m_is_little ? size - 1 - k : k)]);
      value = value << 8 | byte;
    }
    return value;
  }

  struct Values {
    uint64_t at = 0, count = 0;
    unsigned type = 0;
  };

  /// Where the values of a tag stand; none where it is missing or lies outside.
  std::optional<Values> find(unsigned tag) const {
    const unsigned word = m_is_big_tiff ? 8 : 4;
    const uint64_t directory = number(m_is_big_tiff ? 8 : 4, word);
    const uint64_t first = directory + (m_is_big_tiff ? 8 : 2), step = m_is_big_tiff ? 20 : 12;
    const uint64_t count = number(directory, m_is_big_tiff ? 8 : 2);
    if (directory > m_bytes.size() || count > m_bytes.size() / step) return std::nullopt;
    for (uint64_t k = 0; k < count; ++k) {
      const uint64_t entry = first + k * step;
      if (number(entry, 2) != tag) continue;
      constexpr std::array<unsigned, 13> kSizes{0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8};
      Values values{entry + 4 + word, number(entry + 4, word), unsigned(number(entry + 2, 2))};
      if (values.type == 0 || values.type >= kSizes.size()) return std::nullopt;
      if (values.count > m_bytes.size()) return std::nullopt;
      const uint64_t bytes = values.count * kSizes[values.type];
      if (bytes > word) values.at = number(values.at, word);
      if (values.at > m_bytes.size() || bytes > m_bytes.size() - values.at) return std::nullopt;
      return values;
    }
    return std::nullopt;
  }

  std::vector<double> doubles(unsigned tag) const {
    std::vector<double> result;
    const auto values = find(tag);
    if (!values || values->type != 12) return result;
    for (uint64_t k = 0; k < values->count; ++k) {
      result.push_back(std::bit_cast<double>(number(values->at + 8 * k, 8)));
    }
    return result;
  }

  std::vector<unsigned> shorts(unsigned tag) const {
    std::vector<unsigned> result;
    const auto values = find(tag);
    if (!values || values->type != 3) return result;
    for (uint64_t k = 0; k < values->count; ++k) result.push_back(unsigned(number(values->at + 2 * k, 2)));
    return result;
  }

  std::string text(unsigned tag) const {
    const auto values = find(tag);
    return values && values->type == 2 ? m_bytes.substr(values->at, values->count) : "";
  }

 private:
  const std::string& m_bytes;
  bool m_is_little;
  bool m_is_big_tiff;
};

constexpr unsigned kPixelScale = 33550, kTiePoints = 33922, kGeoKeys = 34735, kGdalNoData = 42113;
constexpr unsigned kModelType = 1024, kGeographic = 2;

}  // namespace

GeoTags read_geo_tags(const std::string& bytes) {
  const TiffBytes tiff(bytes);
  GeoTags tags;
  if (!tiff.is_tiff()) return tags;
  const auto is_size = [](double x) { return std::isfinite(x) && x > 0.0; };
  const std::vector<double> scale = tiff.doubles(kPixelScale);
  if (scale.size() >= 2 && is_size(scale[0]) && is_size(scale[1])) {
    tags.scale_x = scale[0], tags.scale_y = scale[1];
    const std::vector<double> tie = tiff.doubles(kTiePoints);
    if (tie.size() >= 6) tags.north = tie[4] + tie[1] * scale[1];
  }
  const std::vector<unsigned> keys = tiff.shorts(kGeoKeys);
  for (size_t k = 4; k + 3 < keys.size(); k += 4) {
    if (keys[k] == kModelType && keys[k + 1] == 0) tags.is_geographic = keys[k + 3] == kGeographic;
  }
  const std::string no_data = tiff.text(kGdalNoData);
  char* end = nullptr;
  const double value = std::strtod(no_data.c_str(), &end);
  if (end != no_data.c_str()) tags.no_data = value;
  return tags;
}

}  // namespace pileus
