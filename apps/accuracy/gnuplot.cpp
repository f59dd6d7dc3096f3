#include "apps/accuracy/gnuplot.h"

#include <fstream>
#include <iterator>
#include <vector>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "apps/accuracy/scratch_folder.h"
#include "apps/text_file.h"
#include "lib/core/error.h"

namespace pileus {
namespace {

constexpr int kNoSuchProgram = 127;

/// Where the child's standard streams go.
class Redirections {
 public:
  Redirections() { posix_spawn_file_actions_init(&m_actions); }
  ~Redirections() { posix_spawn_file_actions_destroy(&m_actions); }
  Redirections(const Redirections&) = delete;
  Redirections& operator=(const Redirections&) = delete;

  void add(int stream, const std::string& file, int flags) {
    posix_spawn_file_actions_addopen(&m_actions, stream, file.c_str(), flags, 0600);
  }
  const posix_spawn_file_actions_t* get() const { return &m_actions; }

 private:
  posix_spawn_file_actions_t m_actions{};
};

/// Runs gnuplot to its end; returns its exit code, 127 where there is none.
int run(std::vector<std::string> arguments, const std::string& out, const std::string& err) {
  arguments.insert(arguments.begin(), "gnuplot");
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  Redirections redirections;
  redirections.add(STDIN_FILENO, "/dev/null", O_RDONLY);
  redirections.add(STDOUT_FILENO, out, O_WRONLY | O_CREAT | O_TRUNC);
  redirections.add(STDERR_FILENO, err, O_WRONLY | O_CREAT | O_TRUNC);
  pid_t child = -1;
  if (posix_spawnp(&child, "gnuplot", redirections.get(), nullptr, argv.data(), environ) != 0) {
    return kNoSuchProgram;
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

}  // namespace

bool has_gnuplot() {
  return run({"--version"}, "/dev/null", "/dev/null") == 0;
}

std::string run_gnuplot(const std::string& script) {
  const ScratchFolder scratch;
  const std::string file = scratch / "plot.gp", out = scratch / "out", err = scratch / "err";
  write_text(file, script);
  const int exit_code = run({"-d", file}, out, err);  // -d: nothing of the user's own settings
  if (exit_code != 0) {
    throw Error(ErrorKind::failed, "gnuplot",
                fmt::format("ends with exit code {}: {}", exit_code, text_of(err)));
  }
  return text_of(out);
}

}  // namespace pileus
