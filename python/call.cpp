#include "call.h"

#include <nanobind/stl/string.h>

#include <chrono>
#include <condition_variable>
#include <exception>
#include <new>
#include <thread>

#include "base/activity.h"
#include "base/parallel.h"
#include "base/stopwatch.h"
#include "base/thread_failure.h"
#include "kernels/interruption.h"

namespace nb = nanobind;
using namespace std::chrono_literals;

namespace polymorph {
namespace {

/// Runs `work` on a thread of its own. The destructor waits until it ends.
class Worker {
 public:
  /// Errors: std::system_error, if no thread can be started.
  explicit Worker(const std::function<void()>& work) : thread_([this, &work] { run(work); }) {}
  ~Worker() { thread_.join(); }

  bool ends_within(std::chrono::milliseconds time) {
    std::unique_lock lock(mutex_);
    return ended_.wait_for(lock, time, [this] { return is_done_; });
  }
  std::exception_ptr failure() const { return failure_; }  ///< null if none; call after the end

 private:
  void run(const std::function<void()>& work) {
    try {
      work();
    } catch (...) {
      failure_ = std::current_exception();
    }
    const std::lock_guard lock(mutex_);
    is_done_ = true;
    ended_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable ended_;
  bool is_done_ = false;
  std::exception_ptr failure_;
  std::thread thread_;  // last, because run() uses the other members
};

}  // namespace

void run_call(const nb::object& progress, const std::function<void()>& work) {
  const Stopwatch stopwatch;
  nb::gil_scoped_release release;
  Worker worker(work);
  double next_report = 0.2;
  while (!worker.ends_within(50ms)) {
    const nb::gil_scoped_acquire acquire;
    try {
      if (PyErr_CheckSignals() != 0) throw nb::python_error();
      if (progress.is_none() || stopwatch.seconds() < next_report) continue;
      next_report = stopwatch.seconds() + 0.2;
      progress(current_activity(), stopwatch.seconds());
    } catch (...) {
      const nb::gil_scoped_release release_again;
      request_interruption();
      while (!worker.ends_within(1s)) {
      }
      clear_interruption();
      throw;
    }
  }
  if (worker.failure()) std::rethrow_exception(worker.failure());
}

InterruptibleLock::InterruptibleLock(std::timed_mutex& mutex) : lock_(mutex, std::defer_lock) {
  while (!lock_.try_lock_for(50ms)) check_interruption();
}

void register_errors(nb::module_&) {
  static nb::object error_type;
  error_type = nb::module_::import_("polymorph.error").attr("Error");
  nb::register_exception_translator([](const std::exception_ptr& thrown, void*) {
    const auto raise = [](const Error& error) {
      const nb::object object = error_type(error.message, static_cast<int>(error.code));
      PyErr_SetObject(error_type.ptr(), object.ptr());
    };
    try {
      std::rethrow_exception(thrown);
    } catch (const PythonError& e) {
      raise(e.error);
    } catch (const Interrupted&) {
      raise({ErrorCode::kInterrupted, "stopped with a call of another thread"});
    } catch (const std::bad_alloc&) {
      raise({ErrorCode::kResource,
             "out of memory - use fewer balls, a lower surface.resolution or a smaller image"});
    } catch (const std::exception& e) {
      if (!is_thread_failure(e)) throw;  // nanobind handles it
      raise(make_thread_error(e.what()));
    }
  });
}

}  // namespace polymorph
