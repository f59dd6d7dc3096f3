#include "tests/cli/program.h"

#include <chrono>
#include <csignal>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <thread>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace pileus {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::vector<char*> as_array(std::vector<std::string>& texts) {
  std::vector<char*> array;
  for (std::string& text : texts) array.push_back(text.data());
  array.push_back(nullptr);
  return array;
}

/// In the child: becomes the program. Only async-signal-safe calls.
[[noreturn]] void become(char** arguments, char** environment, const char* folder, const char* out,
                         const char* err, size_t address_space_bytes) {
  const bool is_set = (!*folder || chdir(folder) == 0) &&
                      dup2(open("/dev/null", O_RDONLY), STDIN_FILENO) >= 0 &&
                      dup2(open(out, O_WRONLY | O_CREAT | O_TRUNC, 0600), STDOUT_FILENO) >= 0 &&
                      dup2(open(err, O_WRONLY | O_CREAT | O_TRUNC, 0600), STDERR_FILENO) >= 0;
  const rlimit no_core{0, 0}, space{address_space_bytes, address_space_bytes};
  setrlimit(RLIMIT_CORE, &no_core);
#ifndef __SANITIZE_ADDRESS__  // its shadow memory alone takes more
  if (address_space_bytes > 0) setrlimit(RLIMIT_AS, &space);
#else
  (void)space;
#endif
  if (is_set) execve(arguments[0], arguments, environment);
  _exit(127);
}

}  // namespace

Program::Program(const std::vector<std::string>& arguments, const ProgramOptions& options) {
  std::vector<std::string> command{PILEUS_PROGRAM};
  command.insert(command.end(), arguments.begin(), arguments.end());
  std::vector<std::string> variables;
  for (char** variable = environ; *variable; ++variable) variables.emplace_back(*variable);
  variables.insert(variables.begin(), options.environment.begin(), options.environment.end());
  const std::vector<char*> argv = as_array(command), envp = as_array(variables);
  const std::string out = m_output / "out", err = m_output / "err";
  m_pid = fork();
  if (m_pid < 0) throw std::runtime_error("no child process can be made");
  if (m_pid == 0) {
    become(const_cast<char**>(argv.data()), const_cast<char**>(envp.data()), options.folder.c_str(),
           out.c_str(), err.c_str(), options.address_space_bytes);
  }
}

Program::~Program() {
  if (is_running()) wait(0.0);
}

void Program::send(int signal) const {
  if (!m_ended) kill(m_pid, signal);
}

bool Program::is_running() {
  if (!m_ended) m_ended = waitpid(m_pid, &m_status, WNOHANG) == m_pid;
  return !m_ended;
}

void Program::wait_until_it_handles(int signal) {
  const std::string status_file = "/proc/" + std::to_string(m_pid) + "/status";
  for (int n = 0; n < 2000 && is_running(); ++n) {
    std::istringstream status(read_file(status_file));
    for (std::string line; std::getline(status, line);) {
      constexpr std::string_view kCaught = "SigCgt:";
      if (line.rfind(kCaught, 0) != 0) continue;
      const uint64_t mask = std::stoull(line.substr(kCaught.size()), nullptr, 16);
      if ((mask >> (signal - 1)) & 1) return;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

ProgramOutcome Program::wait(double patience) {
  const Clock::time_point start = Clock::now();
  while (is_running() && seconds_since(start) < patience) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  ProgramOutcome outcome;
  outcome.seconds = seconds_since(start);
  if (is_running()) {
    kill(m_pid, SIGKILL);
    waitpid(m_pid, &m_status, 0);
    m_ended = true;
  }
  if (WIFEXITED(m_status)) outcome.exit_code = WEXITSTATUS(m_status);
  outcome.out = read_file(m_output / "out");
  outcome.err = read_file(m_output / "err");
  return outcome;
}

ProgramOutcome run_program(const std::vector<std::string>& arguments, const ProgramOptions& options) {
  return Program(arguments, options).wait();
}

std::string read_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

std::string ProgramTest::write(const std::string& name, const std::string& text) const {
  std::ofstream(folder / name, std::ios::binary) << text;
  return name;
}

ProgramOutcome ProgramTest::run(const std::vector<std::string>& arguments,
                                std::vector<std::string> environment) const {
  return run_program(arguments, {folder.path(), std::move(environment), 0});
}

}  // namespace pileus
