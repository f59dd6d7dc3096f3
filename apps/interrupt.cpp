#include "apps/interrupt.h"

#include <atomic>
#include <csignal>

#include <unistd.h>

namespace pileus {
namespace {

constexpr int kInterruptedExit = 130;

std::atomic<bool> g_interrupted{false};
std::atomic<int> g_cancellable_scopes{0};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free);

void on_signal(int) {
  // Whoever asks again will not wait for the work at hand.
  if (g_cancellable_scopes == 0 || g_interrupted) _exit(kInterruptedExit);
  g_interrupted = true;
}

}  // namespace

void listen_for_interrupts() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool is_interrupted() {
  return g_interrupted;
}

CancellableScope::CancellableScope() {
  ++g_cancellable_scopes;
}

CancellableScope::~CancellableScope() {
  --g_cancellable_scopes;
}

}  // namespace pileus
