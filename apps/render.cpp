#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "apps/commands.h"
#include "apps/frame_names.h"
#include "apps/interrupt.h"
#include "apps/numbers.h"
#include "apps/progress_bar.h"
#include "apps/render_command.h"
#include "apps/render_frames.h"
#include "apps/text_file.h"
#include "lib/core/atomic_file.h"
#include "lib/core/error.h"
#include "pileus/pileus.h"

namespace pileus {
namespace {

double seconds_since(RenderCommand::Clock::time_point start) {
  return std::chrono::duration<double>(RenderCommand::Clock::now() - start).count();
}

Crop parse_crop(const std::string& text) {
  const auto corners = parse_integers<4>(text, ',');
  if (!corners) {
    throw Error(ErrorKind::usage, SourceLoc{},
                fmt::format("--crop {}; expected X0,Y0,X1,Y1 in pixels", text));
  }
  const auto [x0, y0, x1, y1] = *corners;
  return {x0, y0, x1, y1};
}

/// How far a time limit made the picture coarser than asked; "" where it did not.
std::string accuracy_reached(const RenderReport& report) {
  if (report.coarseness <= 1.0) return "";
  std::string text = fmt::format(", {:.3g} times coarser than asked", report.coarseness);
  if (report.max_error_estimate)
    text += fmt::format("; estimated error at most {:.2g}", *report.max_error_estimate);
  return text;
}

}  // namespace

void RenderCommand::complete_outputs() {
  const bool has_place = frames.empty() || has_frame_number(scene.input);
  if (outputs.empty()) outputs.push_back(scene.input.stem().string() + (has_place ? ".png" : ".%04d.png"));
  for (const auto& output : outputs) check_image_name(output);
  const bool has_exr = std::any_of(outputs.begin(), outputs.end(), [](const auto& output) {
    return CLI::detail::to_lower(output.extension()) == ".exr";
  });
  if (half && !has_exr) {
    throw Error(ErrorKind::usage, SourceLoc{}, "--half is about .exr files; none is to be written");
  }
}

void RenderCommand::check_outputs(const Scene& loaded) const {
  const CancellableScope cancellable;  // no probe shall stay behind
  const bool has_colours = plan_effects(loaded).aovs.count("beauty") > 0;
  for (const auto& output : outputs) {
    if (output == report || std::count(outputs.begin(), outputs.end(), output) > 1) {
      throw Error(ErrorKind::usage, output.string(), "is to be written twice; expected different names");
    }
    if (!has_colours && CLI::detail::to_lower(output.extension()) != ".exr") {
      throw Error(ErrorKind::usage, output.string(),
                  "shows the AOV beauty, which --aov leaves out; expected an .exr file");
    }
    const AtomicFile probe(output);
  }
  if (report.empty()) return;
  std::error_code neither_exists;
  if (std::filesystem::equivalent(report, scene.input, neither_exists)) {
    throw Error(ErrorKind::usage, report.string(), "is the input; expected another name for the report");
  }
  const AtomicFile probe(report);
}

Crop RenderCommand::crop_of(const Scene& loaded) const {
  return crop.empty() ? Crop{0, 0, loaded.render.size.x, loaded.render.size.y} : parse_crop(crop);
}

std::filesystem::path RenderCommand::checkpoint() const {
  return outputs.front().string() + ".partial.exr";
}

Rendering RenderCommand::render_to_files(const Scene& loaded, const Work& work) const {
  RenderOptions options;
  options.threads = threads;
  options.crop = crop_of(loaded);
  options.time_limit = time_limit;
  if (work.has_checkpoint) options.checkpoint = checkpoint();
  options.kept = work.kept;
  options.is_cancelled = is_interrupted;
  // Until the first tile is done nothing is written, so an interrupt may end the program at once.
  std::optional<CancellableScope> cancellable;
  options.progress = [&](double share) {
    if (!cancellable && share > 0.0) cancellable.emplace();
    work.progress(share);
  };
  Rendering rendering = render(loaded, options);
  if (!work.comments.empty()) rendering.image.metadata[kComments] = work.comments;

  const Clock::time_point write_start = Clock::now();
  for (const auto& output : outputs) save(rendering, output, half);
  std::error_code none_there;
  if (work.has_checkpoint) std::filesystem::remove(checkpoint(), none_there);  // only now of no use any more
  auto& seconds = rendering.report.seconds;
  seconds["load"] += work.load_seconds;
  seconds["write"] = seconds_since(write_start);
  seconds["wall"] = seconds_since(work.start);
  return rendering;
}

void RenderCommand::tell(const Rendering& rendering) const {
  for (const std::string& warning : rendering.report.warnings) {
    std::fprintf(stderr, "pileus: warning: %s\n", warning.c_str());
  }
  if (json || quiet) return;
  for (const auto& output : outputs) {
    fmt::print("{}: {} x {} pixels in {:.2f} s{}\n", output.string(), rendering.image.width,
               rendering.image.height, rendering.report.seconds.at("wall"),
               accuracy_reached(rendering.report));
  }
}

void RenderCommand::run_still() {
  Work work;
  work.start = Clock::now();
  complete_outputs();
  std::vector<std::filesystem::path> names = outputs;
  names.insert(names.begin(), scene.input);
  for (const auto& name : names) {
    if (!has_frame_number(name)) continue;
    throw Error(ErrorKind::usage, name.string(),
                "names a sequence of files; expected --frames FIRST-LAST, such as --frames 1-48");
  }
  const Scene loaded = scene.load(frame);
  check_outputs(loaded);
  work.load_seconds = seconds_since(work.start);
  work.has_checkpoint = resume;
  const Rendering rendering = [&] {
    ProgressBar bar("rendering", quiet);
    work.progress = [&](double share) { bar.update(share); };
    return render_to_files(loaded, work);
  }();
  if (!report.empty()) write_text(report, to_json(rendering.report));
  tell(rendering);
  if (json) std::fputs(to_json(rendering.report).c_str(), stdout);
}

void RenderCommand::run() {
  frames.empty() ? run_still() : render_frames(*this);
}

void add_render_command(CLI::App& app, int&) {
  auto command = std::make_shared<RenderCommand>();
  CLI::App* sub = app.add_subcommand(
      "render", "render a scene (.toml) or a bare volume (.vdb, .nvdb, ...) to .exr or .png");
  command->scene.add_to(*sub);
  sub->add_option("-o,--output", command->outputs,
                  "picture to write, .exr or .png; may repeat (default: INPUT.png); with %04d where --frames "
                  "puts numbers")
      ->type_name("OUT")
      ->allow_extra_args(false);
  sub->add_option("--threads", command->threads, "number of threads; 0: all cores")
      ->check(CLI::Range(0, 1024));
  sub->add_option("--crop", command->crop, "render these pixels only, X1 and Y1 excluded")
      ->type_name("X0,Y0,X1,Y1");
  CLI::Option* const frames = sub->add_option(
      "--frames", command->frames,
      "a picture for each frame: 1-48, 1-48x4 for every fourth, or a list of such, 1,4,10-20; of a scene, or "
      "of volumes with numbers in their names");
  sub->add_option("--frame", command->frame, "the frame at which keyframes are read (default 0)")
      ->check(finite())
      ->excludes(frames);
  sub->add_option("--report", command->report, "write the figures of the render, or of all frames, as JSON")
      ->type_name("FILE.json");
  CLI::Option* time_limit =
      sub->add_option("--time-limit", command->time_limit,
                      "the most accurate picture (of each frame) that fits into S seconds")
          ->type_name("S")
          ->check(finite_positive());
  sub->add_flag("--resume", command->resume,
                "go on where an interrupted render with --resume, or with --frames, stopped")
      ->excludes(time_limit);
  sub->add_flag("--half", command->half, "store colours as 16-bit floats in .exr");
  sub->add_flag("--json", command->json, "print the figures of the render as JSON");
  sub->add_flag("--quiet", command->quiet, "print nothing but errors");
  sub->footer(
      "Examples:\n"
      "  pileus render smoke1.vdb -o smoke1.png\n"
      "  pileus render scene.toml -o a.exr -o a.png --tolerance 0.0005 --report a.json\n"
      "  pileus render scene.toml -o wide.png --size 1920x800 --set camera.fov_deg=55\n"
      "  pileus render scene.toml -o quick.png --time-limit 2\n"
      "  pileus render morph.toml -o morph.%04d.exr --frames 1-48 --resume\n"
      "  pileus render smoke.%04d.vdb -o smoke.%04d.png --frames 1-48");
  sub->callback([command] { command->run(); });
}

}  // namespace pileus
