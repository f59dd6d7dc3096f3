#include "apps/accuracy/pictures.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <string_view>

#include "apps/accuracy/scratch_folder.h"

namespace pileus {
namespace {

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](size_t n) { return i + n < bytes.size() ? uint32_t(uint8_t(bytes[i + n])) : 0u; };
    const uint32_t group = byte(0) << 16 | byte(1) << 8 | byte(2);
    for (size_t n = 0; n < 4; ++n) {
      const bool is_padding = i + n > bytes.size();
      text += is_padding ? '=' : kDigits[group >> (18 - 6 * n) & 63];
    }
  }
  return text;
}

}  // namespace

std::string data_uri(const Image& image, const DisplayTransform& display) {
  const ScratchFolder scratch;
  const std::filesystem::path file = scratch / "picture.png";
  write_png(file, image, display);
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  return "data:image/png;base64," + base64(bytes);
}

Image error_picture(int width, int height, const std::vector<float>& errors) {
  constexpr double kBlack = 1e-6, kWhite = 0.1;
  Image picture{width, height, {}, {}};
  Channel& grey = picture.add("Y");
  std::transform(errors.begin(), errors.end(), grey.values.begin(), [&](float error) {
    if (std::isnan(error)) return error;
    const double share = std::log(std::max(double(error), kBlack) / kBlack) / std::log(kWhite / kBlack);
    return float(linear_from_srgb(std::min(share, 1.0)));
  });
  return picture;
}

}  // namespace pileus
