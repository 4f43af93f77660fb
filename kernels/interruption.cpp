#include "interruption.h"

#include <time.h>

#include <cstdint>

namespace polymorph {
namespace {

/// Processor time of this process, ns, from which on its computations are interrupted.
std::atomic<std::int64_t> interruption_time{0};
static_assert(std::atomic<std::int64_t>::is_always_lock_free, "set in signal handlers");

std::int64_t processor_nanoseconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1000000000 + now.tv_nsec;
}

}  // namespace

std::atomic<bool> interruption_requested{false};

const char* Interrupted::what() const noexcept { return "interrupted"; }

void request_interruption(double grace) {
  interruption_time = processor_nanoseconds() + static_cast<std::int64_t>(grace * 1e9);
  interruption_requested = true;
}

void clear_interruption() { interruption_requested = false; }

bool is_interrupted() {
  return interruption_requested && processor_nanoseconds() >= interruption_time;
}

void throw_if_interrupted() {
  if (is_interrupted()) throw Interrupted();
}

}  // namespace polymorph
