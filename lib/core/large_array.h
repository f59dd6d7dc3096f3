#pragma once

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>

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

/// Gives a std::vector such memory, and leaves elements that are not given a value as they are.
template <class T>
struct LargeAllocator {
  using value_type = T;
  LargeAllocator() = default;
  template <class U>
  explicit LargeAllocator(const LargeAllocator<U>&) {}
  T* allocate(size_t count) { return make_large_array<T>(count).release(); }
  void deallocate(T* memory, size_t) { std::free(memory); }
  template <class U>
  void construct(U* element) {
    ::new (static_cast<void*>(element)) U;
  }
  template <class U, class... Args>
  void construct(U* element, Args&&... args) {
    ::new (static_cast<void*>(element)) U(std::forward<Args>(args)...);
  }
  bool operator==(const LargeAllocator&) const { return true; }
};

}  // namespace pileus
