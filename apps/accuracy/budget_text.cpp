#include "apps/accuracy/budget_text.h"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/accuracy/report.h"

namespace pileus {
namespace {

/// A word of a shell command: in single quotes where it holds more than plain characters.
std::string shell_word(const std::string& text) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./:,@%";
  if (!text.empty() && text.find_first_not_of(kPlain) == text.npos) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

}  // namespace

std::string render_command(const SceneOptions& scene, const std::string& size, int threads,
                           const AccuracySetting& setting) {
  std::vector<std::string> words{"pileus", "render", scene.input.string(), "-o",
                                 scene.input.stem().string() + ".exr"};
  const auto add = [&](const std::string& option, const std::string& value) {
    words.push_back(option);
    words.push_back(value);
  };
  if (!size.empty()) add("--size", size);
  if (threads > 0) add("--threads", fmt::format("{}", threads));
  add("--tolerance", fmt::format("{}", setting.tolerance));
  const bool is_plain = setting.method.parameter.empty() && !setting.method.is_set_by_step;
  if (is_plain) add("--integrator", setting.method.integrator);
  if (!is_plain) add("--set", "render.integrator=" + integrator_text(setting));
  for (const std::string& assignment : scene.settings) add("--set", assignment);
  std::string command;
  for (const std::string& word : words) command += (command.empty() ? "" : " ") + shell_word(word);
  return command;
}

std::string to_text(const BudgetAnswer& answer, double budget, const std::string& command) {
  const AccuracyRun& best = answer.best;
  return fmt::format(
      "{}: RMSE {}{}, largest error {}, in {} s ({} to {}) of the {} s allowed; {} s of it to render\n{}\n",
      to_string(best.setting), best.is_resolved ? "" : "below ",
      short_number(
          std::max(best.difference.rmse, best.is_resolved ? 0.0 : answer.reference.rms_error_estimate)),
      short_number(best.difference.max_abs), short_number(best.total.median), short_number(best.total.min),
      short_number(best.total.max), short_number(budget), short_number(best.render.median), command);
}

std::string to_json(const BudgetAnswer& answer, double budget, const std::string& command) {
  const AccuracyRun& best = answer.best;
  nlohmann::ordered_json json{{"budget_seconds", budget},
                              {"method", best.setting.method.name},
                              {"integrator", best.setting.method.integrator},
                              {"step", best.setting.step},
                              {"tolerance", best.setting.tolerance},
                              {"rmse", best.difference.rmse},
                              {"relative_rmse", best.relative_rmse},
                              {"max_abs", best.difference.max_abs},
                              {"is_resolved", best.is_resolved},
                              {"seconds", best.total.median},
                              {"render_seconds", best.render.median},
                              {"runs_measured", answer.measured.size()},
                              {"command", command}};
  if (!best.setting.method.is_set_by_step) json["step"] = nullptr;
  // File names are bytes and need not be UTF-8, which JSON must be.
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace pileus
