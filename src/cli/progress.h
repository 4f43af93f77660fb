// Progress of a run: a bar on a terminal, one line per frame elsewhere.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "cli/command_line.h"
#include "film/render_sequence.h"

namespace polymorph {

/// Makes a callback that shows each finished frame in this mode. kNone shows nothing; kAuto must be
/// resolved before (progress_mode()).
ProgressCallback make_progress(ProgressMode mode);

/// Prints the reason for a failure to standard error as an `openjd_fail` line, which sessions of
/// Open Job Description read.
void print_openjd_failure(const Error& error);

/// Logs the progress at regular intervals while no frame is finished, so that programs that watch
/// the log see that the run goes on.
class Heartbeat {
 public:
  /// Logs a line every `seconds`; none if `seconds` is 0 or the mode is kBar or kNone. `frames`:
  /// number of frames of the run.
  Heartbeat(ProgressMode mode, double seconds, std::size_t frames);
  ~Heartbeat();
  Heartbeat(const Heartbeat&) = delete;
  Heartbeat& operator=(const Heartbeat&) = delete;
  /// Sets the number of finished frames to `done` and restarts the interval.
  void restart(std::size_t done);

 private:
  void run();  ///< loop of `thread_`
  const ProgressMode mode_;
  const std::chrono::duration<double> interval_;
  const std::size_t frames_;
  std::mutex mutex_;
  std::condition_variable changed_;  ///< notified when a flag below is set
  std::size_t done_ = 0;             ///< number of finished frames
  /// Requests to `thread_`, set by restart() and by the destructor.
  bool restarted_ = false, ended_ = false;
  std::thread thread_;
};

}  // namespace polymorph
