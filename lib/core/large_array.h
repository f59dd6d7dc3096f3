#pragma once

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <type_traits>

#include <sys/mman.h>

namespace pileus {

struct FreeDeleter {
  void operator()(void* memory) const { std::free(memory); }
};

/// An array that is not initialised, for plain values.
template <class T>
using LargeArray = std::unique_ptr<T[], FreeDeleter>;

/// Memory for arrays that are read here and there: on huge pages where the system has them. With pages of 4
/// KB a gather waits for the page table more often than for the data. errors: std::bad_alloc
template <class T>
LargeArray<T> make_large_array(size_t count) {
  static_assert(std::is_trivially_destructible_v<T> && std::is_trivially_copyable_v<T>);
  constexpr size_t kHugePage = size_t(2) << 20, kCacheLine = 64;
  const size_t bytes = count * sizeof(T);
  const size_t alignment = bytes >= 2 * kHugePage ? kHugePage : kCacheLine;
  void* memory = std::aligned_alloc(alignment, (bytes / alignment + 1) * alignment);
  if (!memory) throw std::bad_alloc();
  if (alignment == kHugePage) madvise(memory, bytes, MADV_HUGEPAGE);  // a wish; nothing depends on it
  return LargeArray<T>(static_cast<T*>(memory));
}

}  // namespace pileus
