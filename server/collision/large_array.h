/// Arrays that grow to megabytes and are gone through in every tick.
#pragma once

#include <cstddef>
#include <new>
#include <vector>

namespace cradle {

/// Asks the system for large pages; it may say no, and nothing but time is lost.
void prefer_large_pages(void* begin, std::size_t size);

/// Memory in large pages (2 MB instead of 4 kB) once there is enough of it: a tick of a heap goes
/// through some ten megabytes, of which a processor knows the addresses of a part only.
template <class T>
struct LargePages {
  using value_type = T;
  static constexpr std::size_t kPage = std::size_t{1} << 21;

  LargePages() = default;
  template <class U>
  LargePages(const LargePages<U>&) {}

  T* allocate(std::size_t count) {
    const std::size_t size = room_for(count);
    void* const begin = ::operator new(size, alignment(count));
    if (is_large(count)) prefer_large_pages(begin, size);
    return static_cast<T*>(begin);
  }
  void deallocate(T* begin, std::size_t count) { ::operator delete(begin, alignment(count)); }
  bool operator==(const LargePages&) const = default;

 private:
  static bool is_large(std::size_t count) { return count * sizeof(T) > kPage / 2; }
  static std::size_t room_for(std::size_t count) {
    const std::size_t size = count * sizeof(T);
    return is_large(count) ? (size + kPage - 1) / kPage * kPage : size;
  }
  static std::align_val_t alignment(std::size_t count) {
    return std::align_val_t{is_large(count) ? kPage : alignof(T)};
  }
};

template <class T>
using LargeArray = std::vector<T, LargePages<T>>;

}  // namespace cradle
