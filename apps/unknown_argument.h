#pragma once

#include <string>

namespace CLI {
class App;
class Error;
}  // namespace CLI

namespace pileus {

/// What the user reads of a wrong command line: commands and options that do not exist come with the nearest
/// name that does, other complaints are those of CLI11. Fits CLI::App::failure_message.
std::string wrong_usage_text(const CLI::App* app, const CLI::Error& error);

}  // namespace pileus
