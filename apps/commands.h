#pragma once

namespace CLI {
class App;
}

namespace pileus {

// Each subcommand lives in a file of its own and adds itself to the program. Its callback may throw Error
// (main prints it and picks the exit code) or set `exit_code` itself, as `diff --fail` does.
void add_render_command(CLI::App& app, int& exit_code);
void add_cloud_command(CLI::App& app, int& exit_code);
void add_convert_command(CLI::App& app, int& exit_code);
void add_info_command(CLI::App& app, int& exit_code);
void add_explain_command(CLI::App& app, int& exit_code);
void add_accuracy_command(CLI::App& app, int& exit_code);
void add_diff_command(CLI::App& app, int& exit_code);
void add_plugins_command(CLI::App& app, int& exit_code);

}  // namespace pileus
