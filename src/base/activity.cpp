#include "base/activity.h"

#include <fmt/format.h>

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <thread>
#include <vector>

#include "base/log.h"
#include "base/text.h"

namespace polymorph {
namespace {

using Clock = std::chrono::steady_clock;

/// The active stages, and the thread that reports them.
class Watcher {
 public:
  ~Watcher() {
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
  }
  void show(ActivityDisplay display) {
    const std::lock_guard lock(mutex_);
    display_ = display;
    if (display != ActivityDisplay::kNone && !thread_.joinable())
      thread_ = std::thread([this] { report_stages(); });
  }
  std::string current() {
    const std::lock_guard lock(mutex_);
    return stages_.empty() ? std::string() : stages_.back().name;
  }
  unsigned long long begin(std::string name) {
    const std::lock_guard lock(mutex_);
    stages_.push_back({++last_id_, std::move(name), Clock::now()});
    changed_.notify_all();
    return last_id_;
  }
  void end(unsigned long long id) {
    const std::lock_guard lock(mutex_);
    std::erase_if(stages_, [&](const Entry& stage) { return stage.id == id; });
    changed_.notify_all();
  }

 private:
  struct Entry {
    unsigned long long id;
    std::string name;
    Clock::time_point start;
    bool is_reported = false;
  };

  /// Runs on thread_. Reports the innermost stage once, as soon as it has lasted long enough, then
  /// waits for the next change.
  void report_stages() {
    using namespace std::chrono_literals;
    std::unique_lock lock(mutex_);
    while (!ended_) {
      if (stages_.empty() || stages_.back().is_reported) {
        if (stages_.empty() && is_drawn_) {
          is_drawn_ = false;
          set_status_line("");
        }
        changed_.wait(lock);
        continue;
      }
      Entry& stage = stages_.back();
      const auto due = stage.start + (display_ == ActivityDisplay::kLine ? 100ms : 3000ms);
      if (Clock::now() < due) {
        changed_.wait_until(lock, due);
        continue;  // by now the stage may have ended, or a nested one begun
      }
      stage.is_reported = true;
      report(stage);
    }
  }
  void report(const Entry& stage) {
    const double seconds = std::chrono::duration<double>(Clock::now() - stage.start).count();
    if (display_ == ActivityDisplay::kLine) {
      is_drawn_ = true;
      set_status_line(printable(stage.name) + " ...");
    } else if (display_ == ActivityDisplay::kLog) {
      log_info("{} ...", stage.name);
    } else if (display_ == ActivityDisplay::kJson) {
      const std::string line = fmt::format("{{\"stage\":\"{}\",\"seconds\":{:.1f}}}\n",
                                           escape_json(printable(stage.name)), seconds);
      std::fwrite(line.data(), 1, line.size(), stderr);
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Entry> stages_;  ///< sorted by start: the innermost is the last
  std::thread thread_;
  ActivityDisplay display_ = ActivityDisplay::kNone;
  unsigned long long last_id_ = 0;
  bool ended_ = false, is_drawn_ = false;  ///< is_drawn_: the status line shows a stage
};

// The first call of set_status_line() constructs the log, which thus outlives the watcher's thread.
Watcher& watcher() {
  static const bool log_first = (set_status_line(""), true);
  static Watcher instance;
  (void)log_first;
  return instance;
}

}  // namespace

void show_activities(ActivityDisplay display) { watcher().show(display); }

std::string current_activity() { return watcher().current(); }

Activity::Activity(std::string name) : id_(watcher().begin(std::move(name))) {}
Activity::~Activity() { watcher().end(id_); }

}  // namespace polymorph
