#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "apps/commands.h"
#include "apps/convert_options.h"
#include "apps/frame_names.h"
#include "apps/interrupt.h"
#include "apps/progress_bar.h"
#include "lib/core/atomic_file.h"
#include "lib/core/error.h"
#include "vdb_io/load_openvdb.h"

namespace pileus {
namespace {

constexpr const char* kExamples =
    R"(Formats: .vdb (OpenVDB), .nvdb (NanoVDB), .df3 (POV-Ray), .npy (NumPy), .raw (samples; JSON header beside it).
docs/formats.md says what each keeps, and in which order changes are made.

Examples:
  pileus convert smoke.vdb smoke.nvdb                       all grids, nothing lost
  pileus convert cache.vdb fog.df3 --grid density --bits 16 for POV-Ray, with fog.df3.json beside it
  pileus convert fog.df3 fog.vdb                            and back, at the same place and scale
  pileus convert big.vdb small.vdb --half --resample 2x     voxels twice as wide
  pileus convert in.vdb out.vdb --rename smoke=density --crop=-1,0,-1,1,2,1
  pileus convert density.vdb all.vdb --merge velocity.vdb --merge color.vdb
  pileus convert statue.vdb statue_fog.vdb --levelset-to-fog
  pileus convert broken.vdb sound.vdb --nan density=0 --min density=0
  pileus convert smoke.%04d.vdb smoke.%04d.nvdb --frames 1-48)";

void show(const Conversion& conversion, const std::vector<WrittenGrid>& grids) {
  for (const WrittenGrid& grid : grids) {
    fmt::print("{}: {}{} ({}{}), {} active voxels of {:.6g} m\n", conversion.output.string(), grid.name,
               grid.name == grid.name_in_input ? "" : " <- " + grid.name_in_input, grid.value_type,
               grid.grid_class.empty() ? "" : ", " + grid.grid_class, grid.active_voxels, grid.voxel_size);
  }
}

/// Refuses now what could not be written after long work.
void check_writable(const std::filesystem::path& file) {
  const CancellableScope cancellable;
  const AtomicFile probe(file);
}

void convert(const Conversion& conversion, bool quiet) {
  const Tell tell = [=](const std::string& note) {
    if (!quiet) std::fprintf(stderr, "pileus: note: %s\n", note.c_str());
  };
  check_writable(conversion.output);
  std::optional<CancellableScope> cancellable;  // writing cleans up behind itself
  const std::vector<WrittenGrid> written =
      load_openvdb().convert(conversion, tell, [&] { cancellable.emplace(); });
  if (!quiet) show(conversion, written);
  if (is_interrupted()) throw Error(ErrorKind::cancelled, SourceLoc{}, "interrupted");
}

Conversion of_frame(const Conversion& sequence, int frame) {
  Conversion conversion = sequence;
  conversion.input = frame_name(sequence.input, frame);
  conversion.output = frame_name(sequence.output, frame);
  for (std::filesystem::path& file : conversion.merged) file = frame_name(file, frame);
  return conversion;
}

[[noreturn]] void wrong_usage(const std::string& message) {
  throw Error(ErrorKind::usage, SourceLoc{}, message);
}

void run(const ConvertOptions& options) {
  const Conversion conversion = options.read();
  const bool is_sequence = has_frame_number(conversion.input) || has_frame_number(conversion.output);
  if (!is_sequence && options.frames.empty()) return convert(conversion, options.quiet);
  if (!is_sequence)
    wrong_usage("--frames needs a place for the number in both names, such as smoke.%04d.vdb");
  if (options.frames.empty()) {
    wrong_usage("a sequence of files; expected --frames FIRST-LAST, such as --frames 1-48");
  }
  if (!has_frame_number(conversion.output)) {
    wrong_usage("every frame would be written to the same file; expected a name such as smoke.%04d.vdb");
  }
  const std::vector<int> numbers = parse_frames(options.frames);
  ProgressBar bar("converting", options.quiet);
  for (size_t i = 0; i < numbers.size(); ++i) {
    convert(of_frame(conversion, numbers[i]), options.quiet);
    bar.update(double(i + 1) / double(numbers.size()));
  }
}

}  // namespace

void add_convert_command(CLI::App& app, int&) {
  auto options = std::make_shared<ConvertOptions>();
  CLI::App* command =
      app.add_subcommand("convert", "convert volumes between .vdb, .nvdb, .df3, .npy and .raw");
  options->add_to(*command);
  command->footer(kExamples);
  command->callback([options] { run(*options); });
}

}  // namespace pileus
