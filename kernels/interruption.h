// Interruption: ends long computations of this process early, on request.
#pragma once

#include <atomic>
#include <exception>

namespace polymorph {

/// Thrown out of a computation that is interrupted. Its result is incomplete and discarded; all
/// other state stays valid.
class Interrupted : public std::exception {
 public:
  const char* what() const noexcept override;
};

/// Requests that all computations of this process end. After the process has used `grace` more
/// seconds of processor time, and until clear_interruption(), every parallel loop and every call of
/// check_interruption() throws Interrupted. Safe in a signal handler.
void request_interruption(double grace = 0);
void clear_interruption();
/// Tests whether check_interruption() would throw.
bool is_interrupted();

extern std::atomic<bool> interruption_requested;
/// Throws Interrupted if is_interrupted().
void throw_if_interrupted();

/// Throws Interrupted if an interruption is requested and its grace is over. Parallel loops call it
/// (base/parallel.h); code that works for more than 0.1 s outside them has to.
inline void check_interruption() {
  if (interruption_requested.load(std::memory_order_relaxed)) throw_if_interrupted();
}

}  // namespace polymorph
