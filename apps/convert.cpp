#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "apps/commands.h"
#include "apps/frame_names.h"
#include "apps/interrupt.h"
#include "apps/numbers.h"
#include "apps/progress_bar.h"
#include "lib/core/atomic_file.h"
#include "lib/core/error.h"
#include "lib/core/version.h"
#include "vdb_io/grid_edits.h"
#include "vdb_io/vdb_reader.h"
#include "vdb_io/volume_file.h"
#include "vdb_io/volume_writer.h"

namespace pileus {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExamples =
    R"(Formats: .vdb (OpenVDB), .nvdb (NanoVDB), .df3 (POV-Ray), .npy (NumPy), .raw (samples; JSON header beside it).
docs/formats.md says what each keeps.

Examples:
  pileus convert smoke.vdb smoke.nvdb                       all grids, nothing lost
  pileus convert cache.vdb fog.df3 --grid density --bits 16 for POV-Ray, with fog.df3.json beside it
  pileus convert fog.df3 fog.vdb                            and back, at the same place and scale
  pileus convert big.vdb small.vdb --half --resample 2x     voxels twice as wide
  pileus convert in.vdb out.vdb --rename smoke=density --crop=-1,0,-1,1,2,1
  pileus convert density.vdb all.vdb --merge velocity.vdb --merge color.vdb
  pileus convert statue.vdb statue_fog.vdb --levelset-to-fog
  pileus convert smoke.%04d.vdb smoke.%04d.nvdb --frames 1-48)";

/// One grid on its way, and what its file calls it.
struct Carried {
  openvdb::GridBase::Ptr grid;
  std::string name_in_file, base_name;
};

struct ConvertCommand {
  fs::path input, output;
  std::vector<std::string> grids, renames;
  std::vector<fs::path> merges;
  VolumeWriteOptions write;
  bool level_set_to_fog = false, quiet = false;
  std::string resample, crop, frames;

  void run() const;

 private:
  void convert(const fs::path& from, const fs::path& to, const std::vector<fs::path>& merged) const;
  void check_names(const fs::path& from, const fs::path& to, const std::vector<fs::path>& merged) const;
  std::vector<const VdbGridEntry*> chosen(const fs::path& file, const VdbDirectory& directory,
                                          std::set<std::string>& found) const;
  void carry(const fs::path& file, std::vector<Carried>& carried, std::set<std::string>& found) const;
  void edit(const fs::path& file, Carried& carried) const;
  void rename(std::vector<Carried>& carried) const;
  void tell(const std::string& note) const;
  void show(const fs::path& to, const std::vector<Carried>& carried) const;
};

[[noreturn]] void wrong_usage(const std::string& message) {
  throw Error(ErrorKind::usage, SourceLoc{}, message);
}

/// "OLD=NEW"
std::pair<std::string, std::string> parse_rename(const std::string& text) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
    wrong_usage(fmt::format("--rename {}; expected OLD=NEW, such as smoke=density", text));
  }
  return {text.substr(0, equals), text.substr(equals + 1)};
}

NewVoxels parse_voxels(const std::string& text) {
  const bool is_factor = !text.empty() && text.back() == 'x';
  double number = 0.0;
  const bool is_number =
      CLI::detail::lexical_cast(is_factor ? text.substr(0, text.size() - 1) : text, number);
  if (!is_number || !std::isfinite(number) || !(number > 0.0)) {
    wrong_usage(
        fmt::format("--resample {}; expected the edge of a voxel in metres, such as 0.05, or a factor, "
                    "such as 2x",
                    text));
  }
  if (is_factor) return VoxelFactor{number};
  return VoxelEdge{number};
}

Box3d parse_box(const std::string& text) {
  std::vector<double> numbers;
  for (const std::string& part : CLI::detail::split(text, ',')) {
    double number = 0.0;
    if (!CLI::detail::lexical_cast(part, number) || !std::isfinite(number)) break;
    numbers.push_back(number);
  }
  const bool is_box = numbers.size() == 6 && std::count(text.begin(), text.end(), ',') == 5 &&
                      numbers[0] < numbers[3] && numbers[1] < numbers[4] && numbers[2] < numbers[5];
  if (!is_box) {
    wrong_usage(fmt::format("--crop {}; expected X0,Y0,Z0,X1,Y1,Z1 in metres, each lower end first", text));
  }
  return Box3d({numbers[0], numbers[1], numbers[2]}, {numbers[3], numbers[4], numbers[5]});
}

bool is_dense(const fs::path& path) {
  const auto format = volume_format(path);
  return format && *format != VolumeFormat::vdb && *format != VolumeFormat::nvdb;
}

/// A grid that can be carried over; the others are left out, with a word.
std::string why_not(const VdbGridEntry& entry) {
  static const std::set<std::string> kKnown{"float", "double", "int32", "int64",
                                            "bool",  "vec3s",  "vec3d", "vec3i"};
  if (entry.value_type == "points") return "holds points, not a volume";
  if (kKnown.count(entry.value_type) == 0) return "holds values of type " + entry.value_type;
  return entry.has_affine_map() ? "" : "has the transform " + entry.map_type;
}

void ConvertCommand::tell(const std::string& note) const {
  if (!quiet) std::fprintf(stderr, "pileus: note: %s\n", note.c_str());
}

void ConvertCommand::check_names(const fs::path& from, const fs::path& to,
                                 const std::vector<fs::path>& merged) const {
  if (!volume_format(to)) {
    throw Error(ErrorKind::usage, to.string(),
                fmt::format("is no name for a volume; expected one that ends in {}", volume_extensions()));
  }
  std::vector<fs::path> inputs = merged;
  inputs.push_back(from);
  for (const fs::path& input_file : inputs) {
    std::error_code neither_exists;
    if (fs::equivalent(input_file, to, neither_exists)) {
      throw Error(ErrorKind::usage, to.string(), "is an input; expected another name for the output");
    }
  }
}

/// The grids of a file that are asked for: those named, else all, else (for files that hold one) the density.
std::vector<const VdbGridEntry*> ConvertCommand::chosen(const fs::path& file, const VdbDirectory& directory,
                                                        std::set<std::string>& found) const {
  std::vector<const VdbGridEntry*> entries;
  if (grids.empty()) {
    if (is_dense(output)) {
      entries.push_back(&choose_grid(file, directory, ""));
      if (directory.grids.size() > 1) {
        tell(fmt::format("{}: grid {} chosen among {}", file.string(), describe(*entries.front()),
                         directory.grids.size()));
      }
      return entries;
    }
    for (const VdbGridEntry& entry : directory.grids) {
      const std::string reason = why_not(entry);
      if (reason.empty()) entries.push_back(&entry);
      if (!reason.empty())
        tell(fmt::format("{}: grid \"{}\" left out: {}", file.string(), entry.name, reason));
    }
    return entries;
  }
  for (const std::string& wanted : grids) {
    const bool may_be_elsewhere = !merges.empty();
    try {
      const VdbGridEntry& entry = choose_grid(file, directory, wanted);
      found.insert(wanted);
      if (entry.name != wanted && entry.base_name != wanted) {
        tell(fmt::format("{}: grid {} taken for \"{}\"", file.string(), describe(entry), wanted));
      }
      if (std::count(entries.begin(), entries.end(), &entry) == 0) entries.push_back(&entry);
    } catch (const Error&) {
      if (!may_be_elsewhere) throw;
    }
  }
  return entries;
}

void ConvertCommand::carry(const fs::path& file, std::vector<Carried>& carried,
                           std::set<std::string>& found) const {
  const VdbDirectory directory = read_volume_directory(file);
  for (const VdbGridEntry* entry : chosen(file, directory, found)) {
    Carried next{read_volume_grid(file, directory, *entry), entry->name, entry->base_name};
    next.grid->setName(entry->name);
    edit(file, next);
    carried.push_back(std::move(next));
  }
}

void ConvertCommand::edit(const fs::path& file, Carried& carried) const {
  openvdb::GridBase::Ptr& grid = carried.grid;
  if (level_set_to_fog && grid->getGridClass() == openvdb::GRID_LEVEL_SET) {
    const openvdb::FloatGrid::Ptr distances = as_float(grid);
    if (!distances) {
      throw Error(ErrorKind::file, file.string(),
                  fmt::format("grid \"{}\" is a level set of {}; expected one of numbers",
                              carried.name_in_file, grid->valueType()));
    }
    tell(fmt::format("{}: {}", file.string(), turn_level_set_into_fog(file, *distances)));
    distances->setSaveFloatAsHalf(false);
    grid = distances;
  }
  if (!crop.empty()) crop_grid(file, *grid, parse_box(crop));
  if (!resample.empty()) {
    if (grid->getGridClass() == openvdb::GRID_STAGGERED) {
      tell(fmt::format("{}: grid \"{}\" was staggered; its vectors now stand at voxel centres", file.string(),
                       carried.name_in_file));
    }
    grid = resampled_grid(file, *grid, parse_voxels(resample));
  }
}

void ConvertCommand::rename(std::vector<Carried>& carried) const {
  for (const std::string& text : renames) {
    const auto [old_name, new_name] = parse_rename(text);
    std::vector<std::string> names;
    bool is_done = false;
    for (Carried& one : carried) {
      names.push_back(one.name_in_file);
      if (one.name_in_file != old_name && one.base_name != old_name) continue;
      one.grid->setName(new_name);
      is_done = true;
      break;
    }
    if (is_done) continue;
    const std::string nearest = nearest_name(old_name, names);
    wrong_usage(fmt::format("--rename {}: no grid \"{}\"; found {}{}", text, old_name, join_or(names),
                            nearest.empty() ? "" : "; nearest: " + nearest));
  }
  std::set<std::string> names;
  for (const Carried& one : carried) {
    if (names.insert(one.grid->getName()).second) continue;
    wrong_usage(fmt::format("two grids are called \"{}\"; choose with --grid, or name one anew with --rename",
                            one.grid->getName()));
  }
}

void ConvertCommand::show(const fs::path& to, const std::vector<Carried>& carried) const {
  if (quiet) return;
  for (const Carried& one : carried) {
    const openvdb::GridBase& grid = *one.grid;
    const std::string name = grid.getName();
    fmt::print("{}: {}{} ({}{}), {} active voxels of {:.6g} m\n", to.string(), name,
               name == one.name_in_file ? "" : " <- " + one.name_in_file, grid.valueType(),
               grid.getGridClass() == openvdb::GRID_UNKNOWN
                   ? ""
                   : ", " + openvdb::GridBase::gridClassToString(grid.getGridClass()),
               grid.activeVoxelCount(), grid.voxelSize().x());
  }
}

void ConvertCommand::convert(const fs::path& from, const fs::path& to,
                             const std::vector<fs::path>& merged) const {
  check_names(from, to, merged);
  const CancellableScope cancellable;  // writing cleans up behind itself
  const AtomicFile probe(to);          // refuse now what could not be written after long work
  std::vector<Carried> carried;
  std::set<std::string> found;
  carry(from, carried, found);
  for (const fs::path& file : merged) carry(file, carried, found);
  for (const std::string& wanted : grids) {
    if (found.count(wanted) > 0) continue;
    throw Error(ErrorKind::file, from.string(),
                fmt::format("no grid \"{}\", nor in the merged files", wanted));
  }
  if (carried.empty()) throw Error(ErrorKind::file, from.string(), "holds no grid that can be converted");
  rename(carried);

  openvdb::MetaMap metadata = read_volume_metadata(from);
  if (!metadata["creator"])
    metadata.insertMeta("creator", openvdb::StringMetadata(fmt::format("pileus {}", kVersion)));
  std::vector<openvdb::GridBase::Ptr> to_write;
  for (const Carried& one : carried) to_write.push_back(one.grid);
  if (is_interrupted()) throw Error(ErrorKind::cancelled, SourceLoc{}, "interrupted");
  for (const std::string& note : write_volume(to, to_write, metadata, write)) {
    tell(fmt::format("{}: {}", to.string(), note));
  }
  show(to, carried);
}

void ConvertCommand::run() const {
  if (!crop.empty()) parse_box(crop);
  if (!resample.empty()) parse_voxels(resample);
  const bool is_sequence = has_frame_number(input) || has_frame_number(output);
  if (!is_sequence && !frames.empty()) {
    wrong_usage("--frames needs a place for the number in both names, such as smoke.%04d.vdb");
  }
  if (!is_sequence) return convert(input, output, merges);
  if (frames.empty() || !has_frame_number(output)) {
    wrong_usage(frames.empty() ? "a sequence of files; expected --frames FIRST-LAST, such as --frames 1-48"
                               : "every frame would be written to the same file; expected a name such as "
                                 "smoke.%04d.vdb");
  }
  const std::vector<int> numbers = parse_frames(frames);
  ProgressBar bar("converting", quiet);
  for (size_t i = 0; i < numbers.size(); ++i) {
    std::vector<fs::path> merged;
    for (const fs::path& file : merges) merged.push_back(frame_name(file, numbers[i]));
    convert(frame_name(input, numbers[i]), frame_name(output, numbers[i]), merged);
    bar.update(double(i + 1) / double(numbers.size()));
  }
}

}  // namespace

void add_convert_command(CLI::App& app, int&) {
  auto command = std::make_shared<ConvertCommand>();
  CLI::App* sub = app.add_subcommand("convert", "convert volumes between .vdb, .nvdb, .df3, .npy and .raw");
  sub->add_option("IN", command->input, "volume to read")->required();
  sub->add_option("OUT", command->output,
                  "volume to write; an existing file is replaced when the new one is whole")
      ->required();
  sub->add_option("--grid", command->grids,
                  "grid to take, by name or by what programs call it; may repeat (default: all)")
      ->type_name("NAME")
      ->allow_extra_args(false);
  sub->add_option("--rename", command->renames, "write grid OLD under the name NEW; may repeat")
      ->type_name("OLD=NEW")
      ->allow_extra_args(false);
  sub->add_option("--merge", command->merges, "take the grids of this file, too; may repeat")
      ->type_name("FILE")
      ->allow_extra_args(false);
  sub->add_flag("--half", command->write.half, "store values as 16-bit floats (.vdb, .npy, .raw)");
  sub->add_option("--codec", command->write.codec,
                  "compression: none, zip or blosc (default: blosc for .vdb, none for .nvdb)")
      ->type_name("NAME");
  sub->add_option("--bits", command->write.df3_bits, "whole numbers of a .df3 file: 8, 16 or 32")
      ->check(CLI::IsMember({8, 16, 32}))
      ->capture_default_str();
  sub->add_flag("--levelset-to-fog", command->level_set_to_fog,
                "fill the inside of level sets with density 1");
  sub->add_option("--resample", command->resample, "new voxels: an edge in metres, or a factor such as 2x")
      ->type_name("VOXEL");
  sub->add_option("--crop", command->crop, "keep the voxels whose centres lie in this box of the world [m]")
      ->type_name("X0,Y0,Z0,X1,Y1,Z1");
  sub->add_option("--frames", command->frames, "numbers to put for %04d in the names: 1-48, or 1-48x4")
      ->type_name("FIRST-LAST");
  sub->add_flag("--quiet", command->quiet, "print nothing but errors");
  sub->footer(kExamples);
  sub->callback([command] { command->run(); });
}

}  // namespace pileus
