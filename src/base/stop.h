// Signals that ask the program to stop: SIGINT, SIGTERM and SIGUSR1, which farms send before the
// time of a job is up.
#pragma once

#include <atomic>

#include "base/result.h"

namespace polymorph {

/// Returns a flag that is true once one of the signals has come. The first call installs the
/// handlers; before it, any of the signals ends the process at once. Afterwards, the second signal
/// of the same kind does so.
const std::atomic<bool>& stop_requested();

/// Exit code for the signal that came: 130 (SIGINT), 143 (SIGTERM) or 75 (SIGUSR1).
ErrorCode stop_code();

}  // namespace polymorph
