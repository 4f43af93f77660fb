#include "base/thread_failure.h"

#include <string_view>
#include <system_error>

namespace polymorph {

bool is_thread_failure(const std::exception& thrown) {
  const auto* system = dynamic_cast<const std::system_error*>(&thrown);
  return (system && system->code() == std::errc::resource_unavailable_try_again) ||
         std::string_view(thrown.what()).starts_with("pthread_create");  // thrown by TBB
}

}  // namespace polymorph
