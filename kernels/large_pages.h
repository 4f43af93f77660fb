// Large memory pages for large arrays. The system provides memory page by page, when each is
// written for the first time; pages of 2 MiB need 512 times fewer of these steps than pages of 4
// KiB.
#pragma once

#if defined(__linux__)
#include <sys/mman.h>
#endif

#include <cstddef>
#include <cstdint>
#include <vector>

namespace polymorph {

/// Asks the system for large pages (MADV_HUGEPAGE) wherever one fits into these bytes, which should
/// not have been written yet. Does nothing if the system has no large pages.
inline void request_large_pages(void* data, std::size_t bytes) {
#if defined(MADV_HUGEPAGE)  // Linux
  constexpr std::uintptr_t kPage = std::uintptr_t{2} << 20;
  const auto begin = reinterpret_cast<std::uintptr_t>(data);
  const std::uintptr_t first = (begin + kPage - 1) / kPage * kPage,
                       last = (begin + bytes) / kPage * kPage;
  // A refusal only costs time.
  if (first < last) (void)madvise(reinterpret_cast<void*>(first), last - first, MADV_HUGEPAGE);
#else
  (void)data, (void)bytes;
#endif
}

/// Makes a vector of `count` zeros in large pages.
template <class T>
std::vector<T> make_large_vector(std::size_t count) {
  std::vector<T> values;
  values.reserve(count);
  request_large_pages(values.data(), count * sizeof(T));
  values.resize(count);
  return values;
}

}  // namespace polymorph
