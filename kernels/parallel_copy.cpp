#include "parallel_copy.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cstring>

#include "fork_join.h"

namespace polymorph {

void parallel_copy(void* to, const void* from, std::size_t bytes) {
  constexpr std::size_t kGrain = std::size_t{128} << 10;  // bytes per chunk
  if (bytes <= kGrain) {
    std::memcpy(to, from, bytes);
    return;
  }
  ForkJoin loop;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, bytes, kGrain),
                    [&](const tbb::blocked_range<std::size_t>& r) {
                      loop.part([&] {
                        std::memcpy(static_cast<char*>(to) + r.begin(),
                                    static_cast<const char*>(from) + r.begin(), r.size());
                      });
                    });
}

}  // namespace polymorph
