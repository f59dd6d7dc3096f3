#include "apps/render_frames.h"

#include <algorithm>
#include <cstdio>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/frame_names.h"
#include "apps/interrupt.h"
#include "apps/progress_bar.h"
#include "apps/text_file.h"
#include "lib/core/error.h"
#include "lib/core/version.h"
#include "lib/scene/animation.h"
#include "pileus/checkpoint.h"
#include "pileus/kept_volumes.h"

namespace pileus {
namespace {

using Clock = RenderCommand::Clock;
using Json = nlohmann::ordered_json;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Calls body; an error that it throws gets the frame's number.
template <class Body>
auto in_frame(int number, Body&& body) {
  try {
    return body();
  } catch (const Error& error) {
    std::vector<Diagnostic> diagnostics = error.diagnostics();
    for (Diagnostic& diagnostic : diagnostics)
      diagnostic.message = fmt::format("frame {}: {}", number, diagnostic.message);
    throw Error(error.kind(), std::move(diagnostics));
  }
}

class FrameSequence {
 public:
  explicit FrameSequence(const RenderCommand& command)
      : m_command(completed(command)),
        m_numbers(parse_frames(command.frames)),
        m_bar("rendering", command.quiet) {}

  void run() {
    plan();
    try {
      for (const int number : m_numbers) {
        if (m_is_whole.at(number)) {
          skip(number);
        } else {
          in_frame(number, [&] { render(number); });
        }
      }
    } catch (const Error&) {
      write_report();
      throw;
    }
    const std::string report = write_report();
    if (m_command.json) std::fputs(report.c_str(), stdout);
  }

 private:
  static RenderCommand completed(RenderCommand command) {
    command.complete_outputs();
    for (const auto& output : command.outputs) {
      if (has_frame_number(output)) continue;
      throw Error(ErrorKind::usage, output.string(),
                  "has no place for the number of a frame; expected one such as frame.%04d.exr");
    }
    const std::filesystem::path& input = command.scene.input;
    if (!is_scene(input) && !has_frame_number(input)) {
      throw Error(ErrorKind::usage, input.string(),
                  "does not change from frame to frame; --frames expects a scene (.toml), or volumes with a "
                  "place for the number, such as smoke.%04d.vdb");
    }
    return command;
  }

  static bool is_scene(const std::filesystem::path& input) { return input.extension() == ".toml"; }

  /// The command of one frame. Bare volumes are all shown as the last one: a camera and an extinction that
  /// fit each of them anew would jump.
  RenderCommand at(int number) const {
    RenderCommand command = m_command;
    command.frame = number;
    const std::filesystem::path& input = m_command.scene.input;
    if (is_scene(input)) {
      command.scene.input = frame_name(input, number);
    } else {
      command.scene.input = frame_name(input, m_numbers.back());
      command.scene.overrides.push_back("volume.volume.file=" + frame_name(input, number).string());
    }
    for (auto& output : command.outputs) output = frame_name(output, number);
    return command;
  }

  /// What a frame's pictures depend on, as a text for their comments.
  std::string origin_of(const RenderCommand& command, const Scene& loaded) const {
    return fmt::format("pileus {}{}", fingerprint_of(loaded, command.crop_of(loaded)),
                       command.half ? " half" : "");
  }

  /// Every frame is looked at before the first is rendered: mistakes in late ones are told now.
  void plan() {
    for (const int number : m_numbers) {
      in_frame(number, [&] {
        const RenderCommand command = at(number);
        const Scene loaded = command.scene.load(number);
        check_file(number);
        m_is_whole[number] = m_command.resume && is_whole(command, origin_of(command, loaded));
        if (m_is_whole[number]) return;
        command.check_outputs(loaded);
        ++m_left;
      });
    }
    m_todo = m_left;
  }

  void check_file(int number) const {
    const std::filesystem::path file = frame_name(m_command.scene.input, number);
    std::error_code unknown;
    if (!std::filesystem::exists(file, unknown)) throw Error(ErrorKind::file, file.string(), "no such file");
  }

  /// True where all pictures of a frame can be read to their ends and were made of the same.
  static bool is_whole(const RenderCommand& command, const std::string& origin) {
    return std::all_of(command.outputs.begin(), command.outputs.end(), [&](const auto& output) {
      std::error_code unknown;
      if (!std::filesystem::exists(output, unknown)) return false;
      try {
        return comments_of(read_image(output)) == origin;
      } catch (const Error&) {
        return false;  // damaged: it is rendered again
      }
    });
  }

  void skip(int number) {
    add_to_report(number, nullptr);
    if (m_command.quiet || m_command.json) return;
    m_bar.wipe();
    for (const auto& output : at(number).outputs) fmt::print("{}: is there\n", output.string());
  }

  void render(int number) {
    if (is_interrupted()) throw Error(ErrorKind::cancelled, SourceLoc{}, "interrupted");
    const RenderCommand command = at(number);
    RenderCommand::Work work;
    work.start = Clock::now();
    const Scene loaded = command.scene.load(number);
    if (is_scene(command.scene.input)) {
      m_kept.keys = volume_keys(command.scene.input, command.scene.all_overrides(), number);
    }
    work.kept = &m_kept;
    work.load_seconds = seconds_since(work.start);
    work.comments = origin_of(command, loaded);
    work.has_checkpoint = command.time_limit == 0.0;
    std::error_code none_there;
    if (!command.resume) std::filesystem::remove(command.checkpoint(), none_there);
    const std::string task = fmt::format("frame {} ({} of {})", number, m_todo - m_left + 1, m_todo);
    work.progress = [&](double share) {
      m_bar.update(task, (double(m_todo - m_left) + share) / double(m_todo));
    };
    const Rendering rendering = command.render_to_files(loaded, work);
    --m_left;
    add_to_report(number, &rendering.report);
    m_bar.wipe();
    command.tell(rendering);
    std::fflush(stdout);
  }

  /// rendered: null where the frame was there already.
  void add_to_report(int number, const RenderReport* rendered) {
    Json outputs = Json::array();
    for (const auto& output : at(number).outputs) outputs.push_back(output.string());
    m_frames.push_back({{"frame", number},
                        {"outputs", outputs},
                        {"skipped", rendered == nullptr},
                        {"report", rendered ? Json::parse(to_json(*rendered)) : Json(nullptr)}});
  }

  std::string report_text() const {
    const Json json{{"version", kVersion},
                    {"scene", m_command.scene.input.string()},
                    {"seconds", {{"wall", seconds_since(m_start)}}},
                    {"frames_left", m_left},
                    {"frames", m_frames}};
    // File names are bytes and need not be UTF-8, which JSON must be.
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
  }

  std::string write_report() const {
    const std::string report = report_text();
    if (!m_command.report.empty()) write_text(m_command.report, report);
    return report;
  }

  const RenderCommand m_command;
  const std::vector<int> m_numbers;
  const Clock::time_point m_start = Clock::now();
  std::map<int, bool> m_is_whole;  ///< by number: nothing is left to do
  size_t m_todo = 0, m_left = 0;   ///< frames to render: at the start, and now
  KeptVolumes m_kept;
  Json m_frames = Json::array();
  ProgressBar m_bar;
};

}  // namespace

void render_frames(const RenderCommand& command) {
  FrameSequence(command).run();
}

}  // namespace pileus
