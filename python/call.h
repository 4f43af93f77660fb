// Calls from Python: errors that cross the border, and long work that answers signals and reports
// its progress.
#pragma once

#include <nanobind/nanobind.h>

#include <functional>
#include <mutex>
#include <utility>

#include "base/result.h"

namespace polymorph {

/// Thrown across the border, where it becomes polymorph.Error(message, code).
struct PythonError {
  Error error;
};

template <class T>
T take(Result<T> result) {
  if (!result) throw PythonError{std::move(result).error()};
  return std::move(result).value();
}
inline void check(Status status) {
  if (!status) throw PythonError{std::move(status).error()};
}

/// Runs `work` on a thread of its own, without the interpreter's lock. Meanwhile the calling thread
/// handles signals, and calls progress(stage, seconds) five times a second unless it is None. If
/// either raises an exception, the work is stopped and the exception is thrown.
void run_call(const nanobind::object& progress, const std::function<void()>& work);

/// Holds a lock for its lifetime. While it waits, it ends as interrupted work does.
class InterruptibleLock {
 public:
  explicit InterruptibleLock(std::timed_mutex& mutex);

 private:
  std::unique_lock<std::timed_mutex> lock_;
};

/// Makes polymorph.Error of C++ exceptions. Memory and threads that are not there have code 5.
void register_errors(nanobind::module_& module);

}  // namespace polymorph
