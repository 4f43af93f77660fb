// Support for calls from Python: C++ errors become Python exceptions; long work handles signals and
// reports its progress.
#pragma once

#include <nanobind/nanobind.h>

#include <functional>
#include <mutex>
#include <utility>

#include "base/result.h"

namespace polymorph {

/// The exception that nanobind turns into polymorph.Error(message, code).
struct PythonError {
  Error error;
};

/// take() returns a result's value; take() and check() throw errors as PythonError.
template <class T>
T take(Result<T> result) {
  if (!result) throw PythonError{std::move(result).error()};
  return std::move(result).value();
}
inline void check(Status status) {
  if (!status) throw PythonError{std::move(status).error()};
}

/// Runs `work` on a thread of its own, without the interpreter's lock. Meanwhile this thread
/// handles signals and calls progress(stage, seconds) five times a second, unless it is None. An
/// exception of a signal handler or of `progress` interrupts the work and is rethrown.
void run_call(const nanobind::object& progress, const std::function<void()>& work);

/// Holds a lock for its lifetime. The constructor waits for the lock; it throws Interrupted if an
/// interruption is requested meanwhile.
class InterruptibleLock {
 public:
  explicit InterruptibleLock(std::timed_mutex& mutex);

 private:
  std::unique_lock<std::timed_mutex> lock_;
};

/// Turns C++ exceptions into polymorph.Error. A lack of memory or of threads has code 5.
void register_errors(nanobind::module_& module);

}  // namespace polymorph
