// What memory alone takes of building bricks: nothing that touches so much of it can be faster.
#include <algorithm>
#include <cstdint>
#include <vector>

#include <benchmark/benchmark.h>

#include "lib/core/large_array.h"
#include "lib/core/parallel.h"

namespace pileus::bench {
namespace {

constexpr size_t kChunk = size_t(1) << 18;  ///< bytes of a task

/// Writes to memory that nobody has used yet, on all cores. The argument is in MB.
void write_new(benchmark::State& state) {
  const size_t chunks = size_t(state.range(0)) * 1'000'000 / kChunk;
  for (auto _ : state) {
    const auto memory = make_large_array<char>(chunks * kChunk);
    parallel_for(chunks, [&](size_t i) { std::fill_n(memory.get() + i * kChunk, kChunk, char(i)); });
    benchmark::DoNotOptimize(memory.get());
  }
  state.SetBytesProcessed(int64_t(chunks * kChunk) * state.iterations());
}
BENCHMARK(write_new)->Name("memory/write_new")->Arg(152)->Unit(benchmark::kMillisecond)->UseRealTime();

/// Reads memory that is larger than all caches, on all cores.
void read_all(benchmark::State& state) {
  const size_t chunks = size_t(state.range(0)) * 1'000'000 / kChunk, words = kChunk / sizeof(uint64_t);
  const std::vector<uint64_t> memory(chunks * words, 1);
  std::vector<uint64_t> sums(chunks);
  for (auto _ : state) {
    parallel_for(chunks, [&](size_t i) {
      uint64_t sum = 0;
      for (size_t k = 0; k < words; ++k) sum += memory[i * words + k];
      sums[i] = sum;
    });
    benchmark::DoNotOptimize(sums.data());
  }
  state.SetBytesProcessed(int64_t(chunks * kChunk) * state.iterations());
}
BENCHMARK(read_all)->Name("memory/read_all")->Arg(196)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace pileus::bench
