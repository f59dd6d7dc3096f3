#include "apps/limited_child.h"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <thread>

#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "apps/interrupt.h"
#include "lib/core/memory_budget.h"

namespace pileus {
namespace {

// Address space that threads reserve and hardly use (stack, arena of malloc), and working memory beside the
// grid.
constexpr uint64_t kBytesPerThread = 80u << 20, kWorkingBytes = 600u << 20;
constexpr unsigned kLeastSeconds = 60;
constexpr uint64_t kBytesPerSecond = 2'000'000;  // a slow machine reads and counts more than this

uint64_t address_space_in_use() {
  uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * uint64_t(sysconf(_SC_PAGESIZE));
}

void limit(int resource, uint64_t value) {
  const rlimit bounds{value, value};
  setrlimit(__rlimit_resource_t(resource), &bounds);
}

void limit_this_process(const ChildLimits& limits) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // where the parent dies
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, limits.cpu_seconds);
#if !defined __SANITIZE_ADDRESS__ && !defined __SANITIZE_THREAD__  // their shadow memory alone takes more
  limit(RLIMIT_AS, address_space_in_use() + limits.memory_bytes);
#endif
}

/// Libraries have started threads by now (OpenEXR's pool), which a child does not inherit: their destructors
/// would wait for them for ever.
void end_without_destructors(int exit_code, void*) {
  std::fflush(nullptr);
  _exit(exit_code);
}

std::string death_text(int signal, const ChildLimits& limits) {
  if (signal == SIGXCPU) return fmt::format("takes more than {} s of processor time", limits.cpu_seconds);
  if (signal == SIGKILL) return "gets the reader killed, for want of memory perhaps";
  return fmt::format("crashes the reader ({})", strsignal(signal));
}

/// Waits for the child's end, passing interrupts on.
int status_at_end_of(pid_t child) {
  const CancellableScope cancellable;  // the child shall clean up first
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    if (is_interrupted()) kill(child, SIGTERM);
  }
  return status;
}

}  // namespace

ChildLimits limits_for_reading(uint64_t file_bytes) {
  const uint64_t threads = std::max(1u, std::thread::hardware_concurrency());
  const uint64_t seconds = kLeastSeconds + file_bytes / kBytesPerSecond;
  return {memory_budget() + kWorkingBytes + threads * kBytesPerThread,
          unsigned(std::min<uint64_t>(seconds, 1'000'000))};
}

std::optional<ChildEnd> split_off_limited_child(const ChildLimits& limits) {
  const pid_t child = fork();
  if (child < 0) return std::nullopt;
  if (child == 0) {
    on_exit(end_without_destructors, nullptr);
    limit_this_process(limits);
    return std::nullopt;
  }
  const int status = status_at_end_of(child);
  if (WIFSIGNALED(status)) return ChildEnd{1, death_text(WTERMSIG(status), limits)};
  return ChildEnd{WEXITSTATUS(status), ""};
}

}  // namespace pileus
