#include <algorithm>
#include <cstdio>
#include <exception>
#include <fstream>
#include <new>
#include <string>

#include <CLI/CLI.hpp>

#include "apps/commands.h"
#include "apps/interrupt.h"
#include "apps/unknown_argument.h"
#include "lib/core/error.h"
#include "lib/core/memory_budget.h"
#include "lib/core/registry.h"
#include "lib/core/version.h"

namespace pileus {
namespace {

enum ExitCode { kDone = 0, kFailed = 1, kWrongUsage = 2, kInterrupted = 130 };

ExitCode exit_code_of(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::usage:
    case ErrorKind::scene:
      return kWrongUsage;
    case ErrorKind::cancelled:
      return kInterrupted;
    case ErrorKind::file:
    case ErrorKind::failed:
      break;
  }
  return kFailed;
}

/// Text that may come from a file, safe for a terminal.
std::string printable(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 32 || c == 127; }, ' ');
  return text;
}

/// Prints the line of the file that a diagnostic points at, with a caret under the column.
void print_source_line(const SourceLoc& loc) {
  std::ifstream file(loc.file);
  std::string line;
  for (int n = 0; n < loc.line; ++n) {
    if (!std::getline(file, line)) return;
  }
  constexpr size_t kShown = 160;  // a machine-made file may have endless lines
  const size_t column = size_t(std::max(0, loc.column - 1));
  const size_t begin = line.size() > kShown && column > kShown / 2 ? column - kShown / 2 : 0;
  line = printable(line.substr(std::min(begin, line.size()), kShown));
  const std::string caret(column - begin, ' ');
  std::fprintf(stderr, "  %s\n  %s^\n", line.c_str(), caret.c_str());
}

void print(const Error& error) {
  for (const Diagnostic& diagnostic : error.diagnostics()) {
    const std::string prefix = diagnostic.loc.file.empty() ? "pileus: " : "";
    std::fprintf(stderr, "%s%s\n", prefix.c_str(), printable(to_string(diagnostic)).c_str());
    if (diagnostic.loc.line > 0) print_source_line(diagnostic.loc);
  }
}

void allow_memory(const std::string& text) {
  const auto bytes = parse_bytes(text);
  if (!bytes) {
    throw Error(ErrorKind::usage, SourceLoc{},
                fmt::format("--memory {}; expected a size such as 512M or 4G", text));
  }
  set_memory_budget(*bytes);
}

int run(int argc, char** argv) {
  int exit_code = kDone;
  CLI::App app("pileus renders volumetric scenes with numbers that can be trusted.", "pileus");
  app.set_version_flag("--version", std::string("pileus ") + kVersion);
  app.require_subcommand(1);
  app.failure_message(wrong_usage_text);
  app.fallthrough();
  app.footer(
      "Examples:\n"
      "  pileus render smoke1.vdb -o smoke1.png        a bare volume with a default sun, sky and framing\n"
      "  pileus render scene.toml -o picture.exr --aov beauty,transmittance,Z\n"
      "  pileus info smoke1.vdb                        what is in a file\n"
      "  pileus convert smoke1.vdb smoke1.nvdb         other formats, names, voxels, parts\n"
      "  pileus explain scene.toml                     what will be simulated, and why\n"
      "  pileus accuracy scene.toml -o accuracy        what accuracy costs in time\n"
      "  pileus COMMAND --help                         options and examples of a command");
  app.add_option("--plugin", "a plugin library (.so) to load first; may repeat (also: PILEUS_PLUGIN_PATH)")
      ->allow_extra_args(false)
      ->type_name("FILE")
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->each([](const std::string& file) { plugin_registry().load_library(file); });
  app.add_option("--memory",
                 "how much one volume may take, such as 512M or 4G (default: half of the machine's memory)")
      ->type_name("SIZE")
      ->each(allow_memory);
  add_render_command(app, exit_code);
  add_cloud_command(app, exit_code);
  add_convert_command(app, exit_code);
  add_info_command(app, exit_code);
  add_explain_command(app, exit_code);
  add_accuracy_command(app, exit_code);
  add_diff_command(app, exit_code);
  add_plugins_command(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const bool is_help = error.get_exit_code() == int(CLI::ExitCodes::Success);
    app.exit(error);
    return is_help ? kDone : kWrongUsage;
  } catch (const Error& error) {
    print(error);
    return exit_code_of(error.kind());
  }
  return exit_code;
}

}  // namespace
}  // namespace pileus

int main(int argc, char** argv) {
  try {
    pileus::listen_for_interrupts();
    const int exit_code = pileus::run(argc, argv);
    if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return exit_code;
    std::fputs("pileus: error: the standard output cannot be written\n", stderr);
    return 1;
  } catch (const std::bad_alloc&) {
    std::fputs("pileus: error: not enough memory\n", stderr);
    return 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "pileus: error: %s\n", error.what());
    return 1;
  }
}
