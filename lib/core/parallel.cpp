#include "lib/core/parallel.h"

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace pileus {

void parallel_for(size_t count, const std::function<void(size_t)>& body) {
  tbb::parallel_for(
      tbb::blocked_range<size_t>(0, count, 1),
      [&](const tbb::blocked_range<size_t>& range) {
        for (size_t i = range.begin(); i != range.end(); ++i) body(i);
      },
      tbb::simple_partitioner());
}

void run_isolated(const std::function<void()>& body) {
  tbb::this_task_arena::isolate(body);
}

void with_threads(int threads, const std::function<void()>& body) {
  if (threads <= 0) return body();
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, size_t(threads));
  tbb::task_arena(threads).execute(body);
}

int thread_count() {
  return tbb::this_task_arena::max_concurrency();
}

}  // namespace pileus
