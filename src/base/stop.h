// Signals that ask the program to stop: SIGINT, SIGTERM and SIGUSR1 (from farms, before time is
// up).
#pragma once

#include <atomic>

#include "base/result.h"

namespace polymorph {

/// Returns a flag that is true once one of the signals has come. The first call installs the
/// handlers; then a second signal of the same kind ends the process at once. Without a call, the
/// first signal does.
const std::atomic<bool>& stop_requested();

/// Exit code for the signal that came: 130 (SIGINT), 143 (SIGTERM) or 75 (SIGUSR1).
ErrorCode stop_code();

}  // namespace polymorph
