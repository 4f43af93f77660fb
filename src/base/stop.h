// Signals that ask the program to stop: SIGINT, SIGTERM, and SIGUSR1, which farms send before time
// is up.
#pragma once

#include <atomic>

#include "base/result.h"

namespace polymorph {

/// True once one of the signals came. They are caught from the first call on; a second signal ends
/// the process at once. A command that never calls this ends at the first.
const std::atomic<bool>& stop_requested();

/// 130, 143 or, for SIGUSR1, 75, by the signal that came.
ErrorCode stop_code();

}  // namespace polymorph
