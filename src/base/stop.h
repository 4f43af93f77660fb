// Signals that ask the program to stop: SIGINT, SIGTERM and SIGUSR1, which farms send before the
// time of a job is up.
#pragma once

#include <atomic>

#include "base/result.h"

namespace polymorph {

/// Returns a flag that becomes true when one of the signals arrives. The first call installs the
/// handlers. Before that call, any of the signals ends the process at once; afterwards, the second
/// signal of the same kind does.
const std::atomic<bool>& stop_requested();

/// Returns the exit code for the signal that arrived: 130 (SIGINT), 143 (SIGTERM) or 75 (SIGUSR1).
ErrorCode stop_code();

}  // namespace polymorph
