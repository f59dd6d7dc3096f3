#include "pileus/accuracy/reference.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "lib/core/error.h"
#include "lib/image/display.h"
#include "lib/image/exr_io.h"
#include "pileus/accuracy/method.h"
#include "pileus/checkpoint.h"

namespace pileus {
namespace {

constexpr const char* kFingerprint = "referenceOf";
constexpr const char* kSeconds = "referenceSeconds";

template <class Value>
const Value* metadata(const Image& image, const char* name) {
  const auto found = image.metadata.find(name);
  return found == image.metadata.end() ? nullptr : std::get_if<Value>(&found->second);
}

/// The reference of an earlier run, where it is one of this scene. Anything else under its name is replaced.
std::optional<Image> earlier_reference(const std::filesystem::path& file, const std::string& fingerprint) {
  std::error_code unknown;
  if (!std::filesystem::exists(file, unknown)) return std::nullopt;
  try {
    Image image = read_exr(file);
    const auto* belongs_to = metadata<std::string>(image, kFingerprint);
    const bool fits = belongs_to && *belongs_to == fingerprint && metadata<double>(image, kSeconds) &&
                      image.find("error_estimate");
    if (fits) return image;
  } catch (const Error&) {  // damaged: it is rendered again
  }
  return std::nullopt;
}

Image render_reference(const Scene& scene, const RenderOptions& options) {
  Rendering rendering = render(scene, options);
  const auto& seconds = rendering.report.seconds;
  rendering.image.metadata[kSeconds] = seconds.at("build") + seconds.at("render");
  return std::move(rendering.image);
}

void fill_figures(AccuracyReference& reference) {
  const std::vector<float>& estimates = reference.image.find("error_estimate")->values;
  double square_sum = 0.0;
  for (const float estimate : estimates) {
    square_sum += double(estimate) * double(estimate);
    reference.max_error_estimate = std::max(reference.max_error_estimate, double(estimate));
  }
  reference.rms_error_estimate = std::sqrt(square_sum / double(estimates.size()));
  double radiance_sum = 0.0;
  for (const Channel* channel : colour_channels(reference.image)) {
    for (const float value : channel->values) radiance_sum += double(value) * double(value);
  }
  reference.rms_radiance = std::sqrt(radiance_sum / (3.0 * double(estimates.size())));
}

}  // namespace

AccuracyReference make_reference(const Scene& scene, double tolerance, const std::filesystem::path& folder,
                                 RenderOptions options) {
  AccuracyReference reference;
  reference.tolerance = tolerance;
  const AccuracySetting setting{{"exact", "exact", "", "", false}, 0.0, tolerance};
  const Scene exact = with_setting(scene, setting, "beauty,error_estimate");
  const Vec2i size = scene.render.size;
  const std::string fingerprint =
      fmt::format("{} tolerance {}", fingerprint_of(scene, {0, 0, size.x, size.y}), tolerance);
  if (folder.empty()) {
    reference.image = render_reference(exact, options);
  } else if (auto earlier = earlier_reference(folder / "reference.exr", fingerprint)) {
    reference.image = std::move(*earlier);
    reference.is_reused = true;
  } else {
    const size_t hash = std::hash<std::string>{}(fingerprint);  // a part of one scene is no part of another
    options.checkpoint = folder / fmt::format("reference-{:016x}.partial.exr", hash);
    reference.image = render_reference(exact, options);
    reference.image.metadata[kFingerprint] = fingerprint;
    write_exr(folder / "reference.exr", reference.image);
    std::error_code none_there;
    std::filesystem::remove(options.checkpoint, none_there);
  }
  reference.seconds = *metadata<double>(reference.image, kSeconds);
  fill_figures(reference);
  return reference;
}

std::vector<float> true_errors(const Image& picture, const Image& reference) {
  const auto x = colour_channels(picture), r = colour_channels(reference);
  std::vector<float> errors(picture.pixel_count());
  for (size_t i = 0; i < errors.size(); ++i) {
    for (size_t c = 0; c < 3; ++c) {
      const float error = std::abs(x[c]->values[i] - r[c]->values[i]);
      errors[i] = error <= errors[i] ? errors[i] : error;  // NaN wins, and stays
      if (std::isnan(error)) break;
    }
  }
  return errors;
}

std::optional<OwnError> judge_own_error(const Image& picture, const char* plane,
                                        const AccuracyReference& reference) {
  const Channel* said = picture.find(plane);
  if (!said) return std::nullopt;
  const std::vector<float>& uncertainty = reference.image.find("error_estimate")->values;
  const std::vector<float> actual = true_errors(picture, reference.image);
  const auto colours = colour_channels(picture);
  OwnError result;
  std::vector<double> ratios;
  size_t count = 0;
  for (size_t i = 0; i < actual.size(); ++i) {
    if (std::isnan(said->values[i]) || std::isnan(actual[i])) continue;
    const double own = said->values[i];
    ++count;
    result.max = std::max(result.max, own);
    result.mean += own;
    double brightest = 0.0;
    for (const Channel* colour : colours)
      brightest = std::max(brightest, std::abs(double(colour->values[i])));
    // Both pictures are rounded to floats, and so is what is said.
    const double rounding = std::numeric_limits<float>::epsilon() * (brightest + own);
    const double unresolved = double(uncertainty[i]) + rounding;
    result.exceeded += double(actual[i]) > own + unresolved;
    if (double(actual[i]) > unresolved) ratios.push_back(own / double(actual[i]));
  }
  if (count == 0) return std::nullopt;
  result.mean /= double(count);
  if (!ratios.empty()) {
    const auto middle = ratios.begin() + std::ptrdiff_t(ratios.size() / 2);
    std::nth_element(ratios.begin(), middle, ratios.end());
    result.effectivity = *middle;
  }
  return result;
}

}  // namespace pileus
