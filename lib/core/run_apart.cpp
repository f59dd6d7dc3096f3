#include "lib/core/run_apart.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <fstream>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include "lib/core/error.h"

namespace pileus {
namespace {

/// [bytes]
uint64_t own_memory() {
  uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * uint64_t(sysconf(_SC_PAGESIZE));
}

void end_after(int timer, int signal, double seconds) {
  std::signal(signal, SIG_DFL);
  itimerval limit{};
  limit.it_value.tv_sec = time_t(seconds);
  limit.it_value.tv_usec = suseconds_t(1e6 * (seconds - std::floor(seconds))) + 1;
  setitimer(timer, &limit, nullptr);
}

void set_limits(const ApartLimits& limits) {
  constexpr double kWaiting = 60.0;  // a copy that waits for ever takes no processor time
  end_after(ITIMER_PROF, SIGPROF, limits.seconds);
  end_after(ITIMER_REAL, SIGALRM, kWaiting * (1.0 + limits.seconds));
  const rlimit memory{own_memory() + limits.bytes, RLIM_INFINITY}, no_core{0, 0};
  setrlimit(RLIMIT_AS, &memory);
  setrlimit(RLIMIT_CORE, &no_core);
  // A library that gives up may say so; nobody is to read it.
  const int nowhere = open("/dev/null", O_WRONLY);
  for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) dup2(nowhere, stream);
  for (const int crash : {SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT}) std::signal(crash, SIG_DFL);
}

/// What the copy does; it never returns.
[[noreturn]] void be_the_copy(const std::function<std::string()>& body, const ApartLimits& limits,
                              int output) {
  set_limits(limits);
  bool is_done = false;
  try {
    const std::string result = body();
    size_t written = 0;
    while (written < result.size()) {
      const ssize_t count = write(output, result.data() + written, result.size() - written);
      if (count < 0 && errno != EINTR) break;
      written += size_t(std::max<ssize_t>(count, 0));
    }
    is_done = written == result.size();
  } catch (...) {  // told by the exit code
  }
  ::_exit(is_done ? 0 : 1);
}

std::string read_all(int input) {
  std::string text;
  std::array<char, 65536> buffer;
  for (;;) {
    const ssize_t count = read(input, buffer.data(), buffer.size());
    if (count == 0 || (count < 0 && errno != EINTR)) return text;
    text.append(buffer.data(), size_t(std::max<ssize_t>(count, 0)));
  }
}

}  // namespace

std::optional<std::string> run_apart(const std::function<std::string()>& body, const ApartLimits& limits) {
  const auto fail = [] {
    throw Error(ErrorKind::failed, SourceLoc{},
                fmt::format("no process can be started: {}", std::strerror(errno)));
  };
  int ends[2];
  if (pipe(ends) != 0) fail();
  const pid_t copy = fork();
  if (copy == 0) {
    close(ends[0]);
    be_the_copy(body, limits, ends[1]);
  }
  close(ends[1]);
  if (copy < 0) {
    close(ends[0]);
    fail();
  }
  std::string result = read_all(ends[0]);
  close(ends[0]);
  int status = 0;
  while (waitpid(copy, &status, 0) < 0 && errno == EINTR) {
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) return std::nullopt;
  return result;
}

}  // namespace pileus
