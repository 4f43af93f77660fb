// Progress display: a bar on a terminal, one line per frame elsewhere.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "cli/command_line.h"
#include "sequence/run/render_sequence.h"

namespace polymorph {

ProgressCallback make_progress(ProgressMode mode);

/// Tells an Open Job Description session why the action fails, in one line of standard error.
void print_openjd_failure(const Error& error);

/// A regular line for logs that are watched by machines: while no frame is finished, a line every
/// so many seconds says how far the run is.
class Heartbeat {
 public:
  /// `seconds` 0, or a mode in which no lines are logged: never.
  Heartbeat(ProgressMode mode, double seconds, std::size_t frames);
  ~Heartbeat();
  Heartbeat(const Heartbeat&) = delete;
  Heartbeat& operator=(const Heartbeat&) = delete;
  /// A frame is finished: the next line is due that many seconds from now.
  void beat(std::size_t done);

 private:
  void run();
  const ProgressMode mode_;
  const std::chrono::duration<double> interval_;
  const std::size_t frames_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t done_ = 0;
  bool beaten_ = false, ended_ = false;
  std::thread thread_;
};

}  // namespace polymorph
