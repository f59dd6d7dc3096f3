#include <charconv>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/commands.h"
#include "lib/core/error.h"
#include "lib/image/difference_image.h"
#include "lib/image/display.h"
#include "lib/image/image_io.h"
#include "lib/image/metrics.h"

namespace pileus {
namespace {

struct DiffArguments {
  std::string test, reference;
  std::string output;  ///< "": no difference image
  std::vector<std::string> fail;
  bool json = false;
  double scale = kDefaultDifferenceScale;
  CompareOptions compare;
};

[[noreturn]] void refuse(const std::string& message) {
  throw Error(ErrorKind::usage, SourceLoc{}, message);
}

// ---- conditions: 'rmse>0.01' ----

struct Condition {
  std::string text;
  const Metric* metric = nullptr;
  std::string comparison;
  double threshold = 0.0;

  /// A metric that is NaN fails every condition: nothing can vouch for the picture then.
  bool holds(const ImageDifference& difference) const {
    const double value = metric->value(difference);
    if (std::isnan(value)) return true;
    if (comparison == ">") return value > threshold;
    if (comparison == ">=") return value >= threshold;
    if (comparison == "<") return value < threshold;
    return value <= threshold;
  }
};

std::string_view trimmed(std::string_view text) {
  const size_t first = text.find_first_not_of(' ');
  if (first == text.npos) return {};
  return text.substr(first, text.find_last_not_of(' ') - first + 1);
}

const Metric& find_metric(std::string_view name, const std::string& condition) {
  std::vector<std::string> names;
  for (const Metric& metric : all_metrics()) {
    if (metric.name == name) return metric;
    names.emplace_back(metric.name);
  }
  const std::string nearest = nearest_name(name, names);
  refuse(fmt::format("--fail '{}': unknown metric \"{}\"; expected {}{}", condition, name, join_or(names),
                     nearest.empty() ? "" : "; nearest: " + nearest));
}

Condition parse_condition(const std::string& text) {
  const std::string_view view = text;
  const size_t begin = view.find_first_of("<>");
  if (begin == view.npos) {
    refuse(fmt::format("--fail '{}': no comparison found; expected >, >=, < or <=, as in 'rmse>0.01'", text));
  }
  const size_t end = begin + (view.substr(begin + 1, 1) == "=" ? 2 : 1);
  Condition condition{text, &find_metric(trimmed(view.substr(0, begin)), text),
                      text.substr(begin, end - begin), 0.0};
  const std::string_view number = trimmed(view.substr(end));
  const auto [rest, error] =
      std::from_chars(number.data(), number.data() + number.size(), condition.threshold);
  if (error != std::errc() || rest != number.data() + number.size() || std::isnan(condition.threshold)) {
    refuse(fmt::format("--fail '{}': \"{}\" is no threshold; expected a number", text, number));
  }
  return condition;
}

/// Pixels that cannot be compared are no part of any other metric, so whoever asks for one asks for none of
/// them too, unless a condition says how many are fine.
std::vector<Condition> parse_conditions(const std::vector<std::string>& texts) {
  std::vector<Condition> conditions;
  bool counts_nan = false;
  for (const std::string& text : texts) {
    conditions.push_back(parse_condition(text));
    counts_nan = counts_nan || conditions.back().metric->name == "nan_pixels";
  }
  if (!conditions.empty() && !counts_nan) conditions.push_back(parse_condition("nan_pixels>0"));
  return conditions;
}

// ---- the report ----

struct DiffReport {
  const DiffArguments& arguments;
  int width, height;
  ImageDifference difference;
  std::vector<Condition> failed;
};

void print_table(const DiffReport& report) {
  const DiffArguments& arguments = report.arguments;
  fmt::print("{} against {}: {} x {} pixels, channels {}\n", arguments.test, arguments.reference,
             report.width, report.height, fmt::join(report.difference.channels, " "));
  for (const Metric& metric : all_metrics()) {
    fmt::print("  {:<10} {:>12.6g} {:<8}  {}\n", metric.name, metric.value(report.difference), metric.unit,
               metric.help);
  }
  if (!arguments.output.empty()) {
    fmt::print("{}: blue is -{:g} or less, white 0, red {:g} or more, magenta not comparable\n",
               arguments.output, arguments.scale, arguments.scale);
  }
}

/// Numbers that are not finite become null, as JSON has none of them.
void print_json(const DiffReport& report) {
  const DiffArguments& arguments = report.arguments;
  nlohmann::ordered_json json{{"test", arguments.test},
                              {"reference", arguments.reference},
                              {"width", report.width},
                              {"height", report.height},
                              {"channels", report.difference.channels}};
  for (const Metric& metric : all_metrics()) {
    const double value = metric.value(report.difference);
    if (metric.unit == "pixels") {
      json["metrics"][std::string(metric.name)] = size_t(value);
    } else {
      json["metrics"][std::string(metric.name)] = value;
    }
  }
  json["failed"] = nlohmann::json::array();
  for (const Condition& condition : report.failed) json["failed"].push_back(condition.text);
  if (!arguments.output.empty()) {
    json["difference_image"] = {{"file", arguments.output}, {"scale", arguments.scale}};
  }
  // File names are bytes and need not be UTF-8, which JSON must be.
  fmt::print("{}\n", json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
}

void require_range(const char* option, double value, double least, double most) {
  if (value >= least && value <= most) return;
  refuse(fmt::format("{} {:g} is out of range; expected {:g} to {:g}", option, value, least, most));
}

/// Refuses before any file is read what cannot work.
std::vector<Condition> check_arguments(const DiffArguments& arguments) {
  require_range("--scale", arguments.scale, 1e-30, 1e30);
  require_range("--exposure", arguments.compare.exposure_stops, -kMaxExposureStops, kMaxExposureStops);
  require_range("--pixels-per-degree", arguments.compare.pixels_per_degree, 1.0, 1000.0);
  if (!arguments.output.empty()) check_image_name(arguments.output);
  return parse_conditions(arguments.fail);
}

int run_diff(const DiffArguments& arguments) {
  const std::vector<Condition> conditions = check_arguments(arguments);
  const Image test = read_image(arguments.test);
  const Image reference = read_image(arguments.reference);

  DiffReport report{
      arguments, test.width, test.height, compare_images(test, reference, arguments.compare), {}};
  for (const Condition& condition : conditions) {
    if (condition.holds(report.difference)) report.failed.push_back(condition);
  }
  if (!arguments.output.empty()) {
    write_image(arguments.output,
                difference_image(test, reference, arguments.scale, arguments.compare.channel));
  }

  arguments.json ? print_json(report) : print_table(report);
  for (const Condition& condition : report.failed) {
    fmt::print(stderr, "fails: {} ({} is {:g})\n", condition.text, condition.metric->name,
               condition.metric->value(report.difference));
  }
  return report.failed.empty() ? 0 : 1;
}

std::string footer() {
  std::string text = "Metrics, of the first picture against the second (the reference):\n";
  for (const Metric& metric : all_metrics()) text += fmt::format("  {:<10} {}\n", metric.name, metric.help);
  return text + R"(
Pictures of integers (PNG, 8-bit TIFF, ...) are linearised first, those of floats are linear already.
A --fail also fails where nan_pixels is not 0, unless a condition names nan_pixels; a metric that is NaN fails.

Examples:
  pileus diff dusk.exr reference.exr
  pileus diff dusk.exr reference.exr --fail 'rmse>0.002' --fail 'ssim<0.99'
  pileus diff dusk.exr reference.exr --channel Z -o depth_error.png --scale 0.5
  pileus diff a.png b.png --json > difference.json

Exit code: 0 compared; 1 a --fail condition holds, or a file cannot be read; 2 wrong usage.)";
}

}  // namespace

void add_diff_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("diff", "How far apart two pictures are");
  const auto arguments = std::make_shared<DiffArguments>();
  command->add_option("test", arguments->test, "the picture to judge (EXR, PNG, TIFF, HDR, ...)")->required();
  command->add_option("reference", arguments->reference, "the picture to judge it by")->required();
  command->add_option("--fail", arguments->fail, "exit with 1 where METRIC>X, >=, < or <= holds; may repeat")
      ->type_name("CONDITION")
      ->allow_extra_args(false);
  command->add_option("-o,--output", arguments->output, "write a difference image (.png or .exr)")
      ->type_name("FILE");
  command->add_option("--scale", arguments->scale, "difference that has the full colour in it")
      ->capture_default_str();
  command->add_option("--channel", arguments->compare.channel, "compare this channel instead of the colours")
      ->type_name("NAME");
  command->add_option("--exposure", arguments->compare.exposure_stops, "stops, for psnr, ssim and flip")
      ->capture_default_str();
  command
      ->add_option("--pixels-per-degree", arguments->compare.pixels_per_degree, "of the observer, for flip")
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "print the results as JSON");
  command->footer(footer());
  command->callback([arguments, &exit_code] { exit_code = run_diff(*arguments); });
}

}  // namespace pileus
