#include "base/large_pages.h"

#include <sys/mman.h>

#include <cstdint>

namespace polymorph {

void request_large_pages(void* data, std::size_t bytes) {
#ifdef MADV_HUGEPAGE  // Linux
  constexpr std::uintptr_t kPage = std::uintptr_t{2} << 20;
  const auto begin = reinterpret_cast<std::uintptr_t>(data);
  const std::uintptr_t first = (begin + kPage - 1) / kPage * kPage,
                       last = (begin + bytes) / kPage * kPage;
  // A refusal only costs time.
  if (first < last) madvise(reinterpret_cast<void*>(first), last - first, MADV_HUGEPAGE);
#else
  (void)data, (void)bytes;
#endif
}

}  // namespace polymorph
