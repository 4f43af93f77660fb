#include "base/stop.h"

#include <time.h>
#include <unistd.h>

#include <csignal>
#include <mutex>
#include <string_view>

#include "base/file.h"
#include "kernels/interruption.h"

namespace polymorph {
namespace {

std::atomic<bool> stop{false};
volatile std::sig_atomic_t stop_signal = 0;

/// Timer that ends the process 1.7 processor seconds after a signal, even inside a library function
/// that does not check for interruption.
timer_t end_timer;
bool has_end_timer = false;
/// Processor seconds after a signal in which frames in progress may be completed.
constexpr double kGraceSeconds = 0.8;
/// The sum of these two is the time of the timer: 1.7 seconds.
constexpr time_t kMaxGraceSeconds = 1;
constexpr long kMaxGraceNanoseconds = 700000000;

void on_stop(int signal_number) {
  stop_signal = signal_number;
  stop = true;
  stop_waiting_for_readers = true;
  std::signal(signal_number, SIG_DFL);   // a second signal of this kind ends the process
  if (signal_number == SIGUSR1) return;  // farms send it early: frames in progress may be completed
  request_interruption(kGraceSeconds);
  itimerspec expiry{};
  expiry.it_value = {kMaxGraceSeconds, kMaxGraceNanoseconds};
  if (has_end_timer) timer_settime(end_timer, /*flags=*/0, &expiry, nullptr);
}

void end_process(int) {
  constexpr std::string_view kText = "error: stopped\n";
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, kText.data(), kText.size());
  ::_exit(128 + stop_signal);
}

void make_end_timer() {
  std::signal(SIGPROF, end_process);
  sigevent event{};
  event.sigev_notify = SIGEV_SIGNAL;
  event.sigev_signo = SIGPROF;
  has_end_timer = timer_create(CLOCK_PROCESS_CPUTIME_ID, &event, &end_timer) == 0;
}

}  // namespace

const std::atomic<bool>& stop_requested() {
  static std::once_flag once;
  std::call_once(once, [] {
    make_end_timer();
    std::signal(SIGINT, on_stop);
    std::signal(SIGTERM, on_stop);
    std::signal(SIGUSR1, on_stop);
  });
  return stop;
}

ErrorCode stop_code() {
  return stop_signal == SIGUSR1   ? ErrorCode::kResumable
         : stop_signal == SIGTERM ? ErrorCode::kTerminated
                                  : ErrorCode::kInterrupted;
}

}  // namespace polymorph
