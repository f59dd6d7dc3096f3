#include "apps/unknown_argument.h"

#include <algorithm>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "lib/core/error.h"

namespace pileus {
namespace {

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  return names;
}

std::vector<std::string> long_options(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

std::string hint(const std::string& wanted, const std::vector<std::string>& names) {
  const std::string nearest = nearest_name(wanted, names);
  return nearest.empty() ? "" : "; nearest: " + nearest;
}

bool is_option(const std::string& argument) {
  return argument.size() > 1 && argument.front() == '-';
}

/// The first option among arguments that nothing takes, or else the first argument: what follows an unknown
/// option is its value perhaps.
std::string first_mistake(const std::vector<std::string>& not_taken) {
  const auto option = std::find_if(not_taken.begin(), not_taken.end(), is_option);
  return option == not_taken.end() ? not_taken.front() : *option;
}

/// command: null where none is given
std::string complaint(const CLI::App& app, const CLI::App* command, const std::string& argument) {
  if (is_option(argument)) {
    std::vector<std::string> options = long_options(app);
    if (command) {
      for (const std::string& option : long_options(*command)) options.push_back(option);
    }
    const std::string option = argument.substr(0, argument.find('='));
    return fmt::format("unknown option {}{}", option, hint(option, options));
  }
  if (!command) {
    const std::vector<std::string> commands = command_names(app);
    return fmt::format("unknown command \"{}\"; expected {}{}", argument, join_or(commands),
                       hint(argument, commands));
  }
  const bool has_output = command->get_option_no_throw("--output") != nullptr;
  return fmt::format("one argument too many: \"{}\"{}", argument,
                     has_output ? "; outputs are named with -o" : "");
}

}  // namespace

std::string wrong_usage_text(const CLI::App* app, const CLI::Error& error) {
  const std::vector<std::string> not_taken = app->remaining(/*recurse=*/true);
  if (not_taken.empty()) return CLI::FailureMessage::simple(app, error);
  const std::vector<CLI::App*> parsed = app->get_subcommands();
  const CLI::App* const command = parsed.empty() ? nullptr : parsed.front();
  const std::string name = command ? "pileus " + command->get_name() : "pileus";
  return fmt::format("{}: error: {}\nRun {} --help for more information.\n", name,
                     complaint(*app, command, first_mistake(not_taken)), name);
}

}  // namespace pileus
