#pragma once

namespace pileus {

/// From here on, Ctrl-C (SIGINT) and SIGTERM end the program with exit code 130: at once, except while a
/// CancellableScope lives.
void listen_for_interrupts();

/// True once the user has interrupted.
bool is_interrupted();

/// While it lives, the first interrupt only sets is_interrupted(), and the work at hand is trusted to poll it
/// and to clean up: rendering (which may leave a checkpoint) and the writing of files. Loading writes
/// nothing, so it needs none.
class CancellableScope {
 public:
  CancellableScope();
  ~CancellableScope();
  CancellableScope(const CancellableScope&) = delete;
  CancellableScope& operator=(const CancellableScope&) = delete;
};

}  // namespace pileus
