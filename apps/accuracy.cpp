#include <algorithm>
#include <charconv>
#include <cstdio>
#include <memory>
#include <optional>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "apps/accuracy/budget_text.h"
#include "apps/accuracy/columns.h"
#include "apps/accuracy/gnuplot.h"
#include "apps/accuracy/plots.h"
#include "apps/accuracy/report.h"
#include "apps/commands.h"
#include "apps/interrupt.h"
#include "apps/numbers.h"
#include "apps/progress_bar.h"
#include "apps/scene_options.h"
#include "apps/text_file.h"
#include "lib/core/atomic_file.h"
#include "lib/core/error.h"
#include "pileus/accuracy/analysis.h"
#include "pileus/accuracy/budget.h"

namespace pileus {
namespace {

namespace fs = std::filesystem;

constexpr int kWidestByDefault = 320;  ///< [pixels]: a table of many runs shall not take the night

struct AccuracyCommand {
  SceneOptions scene;
  fs::path folder;
  std::string size, budget;
  AccuracyOptions options;
  bool quiet = false, json = false;

  void run();

 private:
  void check() const;
  Scene load();
  template <class Work>
  auto with_progress(const std::string& task, Work&& work);
  void measure_all(const Scene& loaded);
  void answer_budget(const Scene& loaded, double seconds);
  std::vector<Figure> draw(const AccuracyStudy& study, const AccuracyAnalysis& analysis) const;
  void tell(const AccuracyStudy& study, const AccuracyAnalysis& analysis) const;
};

[[noreturn]] void refuse(const std::string& message) {
  throw Error(ErrorKind::usage, SourceLoc{}, message);
}

void warn(const std::string& message) {
  std::fprintf(stderr, "pileus: warning: %s\n", message.c_str());
}

/// "0.5s", "500ms" or "0.5" in seconds.
double parse_seconds(const std::string& text) {
  double value = 0.0;
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::string_view unit(rest, size_t(text.data() + text.size() - rest));
  const bool is_time = error == std::errc() && (unit.empty() || unit == "s" || unit == "ms");
  if (!is_time || !std::isfinite(value) || value <= 0.0) {
    refuse(fmt::format("--budget {}; expected a time, such as 0.5s or 500ms", text));
  }
  return unit == "ms" ? 1e-3 * value : value;
}

bool sets(const std::string& assignment, const std::string& key) {
  return assignment.rfind(key, 0) == 0 && assignment.find_first_of("=. ", key.size()) == key.size();
}

/// Refuses what would be ignored, and a folder that cannot be written to, before any time is spent.
void AccuracyCommand::check() const {
  for (const std::string& assignment : scene.settings) {
    for (const char* key : {"render.integrator", "render.tolerance", "render.aovs"}) {
      if (!sets(assignment, key)) continue;
      refuse(fmt::format("--set {}: {} is what is varied here; expected --methods and --tolerances",
                         assignment, key));
    }
  }
  chosen_methods(accuracy_methods(plugin_registry()), options.methods);
  if (folder.empty()) {
    if (budget.empty()) refuse("no folder to write to; expected -o DIR, or --budget SECONDS");
    return;
  }
  std::error_code failure;
  fs::create_directories(folder, failure);
  if (!fs::is_directory(folder)) {
    throw Error(ErrorKind::file, folder.string(),
                failure ? "cannot be made a folder: " + failure.message() : "is no folder");
  }
  const AtomicFile probe(folder / "accuracy.csv");
}

/// The scene at the size asked for, or at its own made small.
Scene AccuracyCommand::load() {
  if (!size.empty()) scene.overrides.push_back(size_override(size));
  Scene loaded = scene.load();
  const Vec2i own = loaded.render.size;
  const bool is_chosen = !size.empty() || std::any_of(scene.settings.begin(), scene.settings.end(),
                                                      [](auto& text) { return sets(text, "render.size"); });
  if (is_chosen || own.x <= kWidestByDefault) return loaded;
  const Vec2i small(kWidestByDefault, std::max(1, (own.y * kWidestByDefault + own.x / 2) / own.x));
  size = fmt::format("{}x{}", small.x, small.y);
  if (!quiet) {
    std::fprintf(stderr, "pileus: measuring at %s pixels instead of %dx%d; --size asks for another size\n",
                 size.c_str(), own.x, own.y);
  }
  scene.overrides.push_back(size_override(size));
  return scene.load();  // again, as the framing of a bare volume depends on the shape of the picture
}

/// Does the work with a progress bar, from the first progress on such that an interrupt is heard.
template <class Work>
auto AccuracyCommand::with_progress(const std::string& task, Work&& work) {
  std::optional<CancellableScope> cancellable;
  ProgressBar bar(task, quiet);
  options.is_cancelled = is_interrupted;
  options.progress = [&](double share) {
    if (!cancellable) cancellable.emplace();
    bar.update(share);
  };
  return work();
}

/// Writes the diagrams and returns them; none where gnuplot is missing or fails, which is said.
std::vector<Figure> AccuracyCommand::draw(const AccuracyStudy& study,
                                          const AccuracyAnalysis& analysis) const {
  if (!has_gnuplot()) {
    warn("gnuplot is not installed (on Debian: gnuplot-nox): the diagrams are left out");
    return {};
  }
  std::vector<Figure> figures;
  try {
    for (const Plot& plot : accuracy_plots(study, analysis)) {
      figures.push_back({plot.caption, run_gnuplot(plot.script)});
      write_text(folder / (plot.name + ".svg"), figures.back().svg);
    }
  } catch (const Error& error) {
    warn(fmt::format("diagrams are left out: {}", error.what()));
  }
  return figures;
}

void AccuracyCommand::tell(const AccuracyStudy& study, const AccuracyAnalysis& analysis) const {
  if (quiet || json) return;
  for (const std::string& note : study.notes) std::fprintf(stderr, "pileus: %s\n", note.c_str());
  const auto text_of = [](const ReadOff& value) {
    if (value.kind == ReadOff::Kind::out_of_reach) return std::string("-");
    return (value.kind == ReadOff::Kind::at_most ? "<= " : "") + short_number(value.value);
  };
  size_t width = 6;
  for (const MethodSummary& method : analysis.methods) width = std::max(width, method.method.name.size());
  fmt::print("{}\n\n{:<{}}", conclusion(study, analysis), "method", width);
  for (const double level : kErrorLevels) fmt::print("  {:>14}", fmt::format("s to RMSE {:g}", level));
  fmt::print("  {:>6}\n", "order");
  for (const MethodSummary& method : analysis.methods) {
    fmt::print("{:<{}}", method.method.name, width);
    for (const ReadOff& seconds : method.seconds_at_error) fmt::print("  {:>14}", text_of(seconds));
    fmt::print("  {:>6}\n", method.order ? fmt::format("{:.2f}", method.order->exponent) : "-");
  }
  fmt::print("\n{}\n", (folder / "report.html").string());
}

void AccuracyCommand::measure_all(const Scene& loaded) {
  const AccuracyStudy study = with_progress("measuring", [&] { return measure_accuracy(loaded, options); });
  const CancellableScope cancellable;  // files are written whole, or not at all
  const AccuracyAnalysis analysis = analyse(study);
  write_text(folder / "accuracy.csv", to_csv(study, analysis));
  const std::vector<Figure> figures = draw(study, analysis);
  write_text(folder / "report.html", to_html(loaded, study, analysis, figures));
  if (json) std::fputs(to_json(loaded, study, analysis).c_str(), stdout);
  tell(study, analysis);
}

void AccuracyCommand::answer_budget(const Scene& loaded, double seconds) {
  const BudgetAnswer answer =
      with_progress("searching", [&] { return best_within(loaded, seconds, options); });
  const std::string command = render_command(scene, size, options.threads, answer.best.setting);
  if (json) {
    std::fputs(to_json(answer, seconds, command).c_str(), stdout);
  } else {
    std::fputs(to_text(answer, seconds, command).c_str(), stdout);
  }
}

void AccuracyCommand::run() {
  const double seconds = budget.empty() ? 0.0 : parse_seconds(budget);
  if (options.tolerances.empty()) options.tolerances = AccuracyOptions().tolerances;
  const Scene loaded = load();
  check();
  options.folder = folder;
  budget.empty() ? measure_all(loaded) : answer_budget(loaded, seconds);
}

constexpr const char* kFooter = R"(
Every integrator is measured as it comes, and with each of its switches turned (march:leaping=false), against the
integrator exact at a tolerance far below the finest. In DIR: accuracy.csv, a row per run; report.html, a page with
diagrams (by gnuplot, where installed) and pictures; the diagrams as .svg; reference.exr, used again while it fits.

Examples:
  pileus accuracy scene.toml -o accuracy
  pileus accuracy smoke1.vdb -o accuracy --size 200x200 --methods exact,uniform --repeat 5
  pileus accuracy scene.toml -o accuracy --tolerances 0.01,0.001 --json > accuracy.json
  pileus accuracy scene.toml --budget 0.5s      the most accurate setting for half a second, and how to render it

Exit code: 0 measured; 1 failed, or nothing is fast enough; 2 wrong usage; 130 interrupted (the reference goes on
where it stopped, the next time).)";

}  // namespace

void add_accuracy_command(CLI::App& app, int&) {
  auto command = std::make_shared<AccuracyCommand>();
  AccuracyOptions& options = command->options;
  CLI::App* sub = app.add_subcommand("accuracy", "what accuracy costs in time, method by method, on a scene");
  command->scene.add_input_to(*sub);
  sub->add_option("-o,--output", command->folder, "folder for the table, the report and the reference")
      ->type_name("DIR");
  sub->add_option("--size", command->size, "picture size in pixels (default: the scene's, at most 320 wide)")
      ->type_name("WxH");
  sub->add_option("--repeat", options.repeat, "timed runs of each setting (default: 3)")
      ->type_name("N")
      ->check(CLI::Range(1, 1000));
  sub->add_option("--threads", options.threads, "number of threads; 0: all cores")
      ->check(CLI::Range(0, 1024));
  options.tolerances.clear();
  sub->add_option("--tolerances", options.tolerances,
                  "tolerances to measure (default: 0.03,0.01,0.003,0.001,0.0003)")
      ->type_name("LIST")
      ->delimiter(',')
      ->check(finite_positive());
  sub->add_option("--methods", options.methods, "methods to measure, such as exact,uniform (default: all)")
      ->type_name("LIST")
      ->delimiter(',');
  sub->add_option("--budget", command->budget,
                  "search the best accuracy for this time instead, such as 0.5s; needs no DIR. The search "
                  "itself takes "
                  "the time of a reference picture and some 10 times S for each method")
      ->type_name("S");
  sub->add_option("--run-limit", options.run_limit, "give a run up that takes longer (default: 20)")
      ->type_name("S")
      ->check(finite_positive());
  command->scene.add_settings_to(*sub);
  sub->add_flag("--json", command->json, "print the figures as JSON");
  sub->add_flag("--quiet", command->quiet, "print nothing but errors and what is asked for");
  sub->footer(kFooter);
  sub->callback([command] { command->run(); });
}

}  // namespace pileus
