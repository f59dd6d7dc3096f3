#pragma once

#include <cstddef>
#include <functional>

namespace pileus {

/// Calls body(i) for every i in [0, count), spread over the machine's threads; oneTBB stays behind this door.
/// Exceptions thrown by body reach the caller. Results must not depend on which thread runs which i.
void parallel_for(size_t count, const std::function<void(size_t)>& body);

/// Runs body; while it waits for a parallel_for of its own, this thread takes up no other work. For what is
/// done under a lock that other work may want, too.
void run_isolated(const std::function<void()>& body);

/// Runs body with exactly `threads` threads for every parallel_for in it; 0 means all cores. More threads
/// than cores are allowed (a test of determinism asks for 7).
void with_threads(int threads, const std::function<void()>& body);

/// Threads that parallel_for uses here.
int thread_count();

}  // namespace pileus
