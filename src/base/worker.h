// Worker thread: runs tasks one after another.
#pragma once

#include <tbb/task_arena.h>

#include <condition_variable>
#include <deque>
#include <future>
#include <mutex>
#include <thread>
#include <type_traits>
#include <utility>

#include "base/parallel.h"

namespace polymorph {

/// Runs tasks on one thread. With a thread per task, memory would grow over a long film: oneTBB's
/// allocator and Embree keep some kilobytes for every thread that ever used them. If all work is
/// limited to one thread, there is no worker thread, and a task runs when its result is requested.
/// The destructor waits for the tasks. A task's parallel loops use up to `max_threads` threads.
class Worker {
 public:
  explicit Worker(int max_threads = tbb::task_arena::automatic) : arena_(max_threads) {}
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;
  ~Worker() {
    if (!thread_.joinable()) return;
    add({});  // an empty task ends work()
    thread_.join();
  }

  /// Runs a task after those before it. Throws std::system_error if the thread cannot be started.
  template <class F>
  std::future<std::invoke_result_t<F&>> run(F task) {
    if (thread_count() == 1) return std::async(std::launch::deferred, std::move(task));
    if (!thread_.joinable()) thread_ = std::thread([this] { work(); });
    std::packaged_task<std::invoke_result_t<F&>()> packaged(std::move(task));
    auto result = packaged.get_future();
    add(Task([packaged = std::move(packaged)]() mutable { packaged(); }));
    return result;
  }

 private:
  using Task = std::packaged_task<void()>;  // accepts move-only callables, unlike std::function

  void add(Task task) {
    {
      const std::lock_guard lock(mutex_);
      tasks_.push_back(std::move(task));
    }
    ready_.notify_one();
  }

  /// Runs tasks until an empty one arrives.
  void work() {
    for (;;) {
      std::unique_lock lock(mutex_);
      ready_.wait(lock, [this] { return !tasks_.empty(); });
      Task task = std::move(tasks_.front());
      tasks_.pop_front();
      lock.unlock();
      if (!task.valid()) return;
      arena_.execute([&] { task(); });
    }
  }

  std::mutex mutex_;
  std::condition_variable ready_;
  std::deque<Task> tasks_;
  std::thread thread_;
  tbb::task_arena arena_;
};

}  // namespace polymorph
