#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include <sys/types.h>

#include "tests/fixtures/temp_folder.h"

namespace pileus {

/// What a run of the program left behind.
struct ProgramOutcome {
  int exit_code = -1;  ///< -1 where a signal ended it, or the test's patience
  std::string out, err;
  double seconds = 0.0;
};

struct ProgramOptions {
  std::filesystem::path folder;          ///< to run in; empty: that of the test
  std::vector<std::string> environment;  ///< "NAME=value", on top of the test's own
  size_t address_space_bytes = 0;        ///< 0: no limit
};

/// The built program as a child process, its output in files of its own. It ends with the object at the
/// latest.
class Program {
 public:
  explicit Program(const std::vector<std::string>& arguments, const ProgramOptions& options = {});
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void send(int signal) const;
  bool is_running();

  /// Waits until the child has a handler for the signal: before that it would just die of it, and on a busy
  /// machine the way to main() is long.
  void wait_until_it_handles(int signal);

  /// Waits for the end; after `patience` seconds the child is killed.
  ProgramOutcome wait(double patience = 60.0);

 private:
  TempFolder m_output;
  pid_t m_pid = -1;
  int m_status = 0;
  bool m_ended = false;
};

/// Runs the program to its end.
ProgramOutcome run_program(const std::vector<std::string>& arguments, const ProgramOptions& options = {});

/// The whole text of a file; "" where there is none.
std::string read_file(const std::filesystem::path& file);

/// A fresh folder, and files in it, for the tests that run the program in it.
class ProgramTest {
 public:
  /// Writes a file and returns its name within the folder.
  std::string write(const std::string& name, const std::string& text) const;
  ProgramOutcome run(const std::vector<std::string>& arguments,
                     std::vector<std::string> environment = {}) const;

  TempFolder folder;
};

/// A scene that every command takes, and that renders in no time: a ball of fog under a sun.
inline constexpr const char* kSmallScene = R"(pileus = 1
[render]
size = [24, 16]
[camera]
type = "perspective"
[light.sun]
type = "sun"
[volume.ball]
type = "ellipsoid"
extinction = 2
phase = { type = "hg", g = 0.3 }
)";

}  // namespace pileus
