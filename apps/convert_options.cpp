#include "apps/convert_options.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "apps/numbers.h"
#include "lib/core/error.h"

namespace pileus {
namespace {

[[noreturn]] void wrong(const std::string& option, const std::string& found, const std::string& expected) {
  throw Error(ErrorKind::usage, SourceLoc{}, fmt::format("{} {}; expected {}", option, found, expected));
}

std::optional<double> finite_number(const std::string& text) {
  double number = 0.0;
  if (!CLI::detail::lexical_cast(text, number) || !std::isfinite(number)) return std::nullopt;
  return number;
}

/// "NAME=VALUE", split at the last sign of equality: names may have some, values have none.
std::pair<std::string, std::string> halves(const std::string& option, const std::string& text,
                                           const std::string& expected) {
  const size_t equals = text.rfind('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) wrong(option, text, expected);
  return {text.substr(0, equals), text.substr(equals + 1)};
}

GridNumbers grid_numbers(const std::string& option, const std::vector<std::string>& texts) {
  const std::string expected = "GRID=NUMBER, such as density=0";
  GridNumbers numbers;
  for (const std::string& text : texts) {
    const auto [grid, value] = halves(option, text, expected);
    const auto number = finite_number(value);
    if (!number) wrong(option, text, expected);
    constexpr float kLargest = std::numeric_limits<float>::max();
    if (std::abs(*number) > kLargest) wrong(option, text, fmt::format("a number up to {:g}", kLargest));
    numbers.push_back({grid, *number});
  }
  return numbers;
}

NewVoxels new_voxels(const std::string& text) {
  const bool is_factor = !text.empty() && text.back() == 'x';
  const auto number = finite_number(is_factor ? text.substr(0, text.size() - 1) : text);
  if (!number || !(*number > 0.0)) {
    wrong("--resample", text, "the edge of a voxel in metres, such as 0.05, or a factor, such as 2x");
  }
  if (is_factor) return VoxelFactor{*number};
  return VoxelEdge{*number};
}

Box3d box(const std::string& text) {
  std::vector<double> numbers;
  for (const std::string& part : CLI::detail::split(text, ',')) {
    if (const auto number = finite_number(part)) numbers.push_back(*number);
  }
  const bool is_box = numbers.size() == 6 && std::count(text.begin(), text.end(), ',') == 5 &&
                      numbers[0] < numbers[3] && numbers[1] < numbers[4] && numbers[2] < numbers[5];
  if (!is_box) wrong("--crop", text, "X0,Y0,Z0,X1,Y1,Z1 in metres, each lower end first");
  return Box3d({numbers[0], numbers[1], numbers[2]}, {numbers[3], numbers[4], numbers[5]});
}

void add_list(CLI::App& command, const char* name, std::vector<std::string>& target, const char* what,
              const char* type) {
  command.add_option(name, target, what)->type_name(type)->allow_extra_args(false);
}

void add_changes(CLI::App& command, ConvertOptions& options) {
  GridChanges& changes = options.conversion.changes;
  command.add_flag("--levelset-to-fog", changes.level_set_to_fog,
                   "fill the inside of level sets with density 1; fog stays as it is");
  add_list(command, "--nan", options.nan,
           "replace NaN and infinite values of a grid, as in density=0; may repeat", "GRID=VALUE");
  add_list(command, "--min", options.lowest,
           "raise lower values of a grid's active voxels to this, empty space to 0 at most; may repeat",
           "GRID=VALUE");
  add_list(command, "--multiply", options.factors,
           "multiply the values of a grid, as in vel=24 for 24 frames a second; may repeat", "GRID=FACTOR");
  add_list(command, "--background", options.backgrounds, "set the value around a grid; may repeat",
           "GRID=VALUE");
  command
      .add_option("--crop", options.crop, "keep the voxels whose centres lie in this box of the world [m]")
      ->type_name("X0,Y0,Z0,X1,Y1,Z1");
  command
      .add_option("--scale", changes.scale,
                  "widen everything about the origin, as in 0.01 from centimetres to metres")
      ->type_name("FACTOR")
      ->check(finite_positive());
  command.add_option("--resample", options.resample, "new voxels: an edge in metres, or a factor such as 2x")
      ->type_name("VOXEL");
  add_list(command, "--rename", options.renames, "write grid OLD under the name NEW; may repeat", "OLD=NEW");
}

}  // namespace

void ConvertOptions::add_to(CLI::App& command) {
  VolumeWriteOptions& write = conversion.write;
  command.add_option("IN", conversion.input, "volume to read")->required();
  command
      .add_option("OUT", conversion.output,
                  "volume to write; an existing file is replaced when the new one is whole")
      ->required();
  add_list(command, "--grid", conversion.grids,
           "grid to take, by name or by what programs call it; may repeat (default: all)", "NAME");
  command.add_option("--merge", conversion.merged, "take the grids of this file, too; may repeat")
      ->type_name("FILE")
      ->allow_extra_args(false);
  add_changes(command, *this);
  command.add_flag("--half", write.half, "store values as 16-bit floats (.vdb, .npy, .raw)");
  command
      .add_option("--codec", write.codec,
                  "compression: none, zip or blosc (default: blosc for .vdb, none for .nvdb)")
      ->type_name("NAME");
  command.add_option("--bits", write.df3_bits, "whole numbers of a .df3 file: 8, 16 or 32 (default: 16)")
      ->check(CLI::IsMember({8, 16, 32}));
  command.add_option("--frames", frames, "numbers to put for %04d in the names: 1-48, or 1-48x4")
      ->type_name("FIRST-LAST");
  command.add_flag("--quiet", quiet, "print nothing but errors");
}

Conversion ConvertOptions::read() const {
  Conversion read = conversion;
  GridChanges& changes = read.changes;
  changes.nan = grid_numbers("--nan", nan);
  changes.lowest = grid_numbers("--min", lowest);
  changes.factors = grid_numbers("--multiply", factors);
  changes.backgrounds = grid_numbers("--background", backgrounds);
  if (!crop.empty()) changes.crop = box(crop);
  if (!resample.empty()) changes.voxels = new_voxels(resample);
  for (const std::string& text : renames) {
    changes.renamings.push_back(halves("--rename", text, "OLD=NEW, such as smoke=density"));
  }
  return read;
}

}  // namespace pileus
