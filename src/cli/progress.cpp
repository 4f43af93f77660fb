#include "cli/progress.h"

#include <sys/ioctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/json.h"
#include "base/log.h"
#include "base/stopwatch.h"
#include "base/text.h"

namespace polymorph {
namespace {

const char* state_word(const FrameRecord& record) {
  switch (record.state) {
    case FrameRecord::State::kDone:
      return "ok";
    case FrameRecord::State::kSkipped:
      return "kept";
    case FrameRecord::State::kFailed:
      return "failed";
    case FrameRecord::State::kPlanned:
      return "planned";
  }
  return "";
}

/// Returns the peak memory of the process in bytes.
double peak_memory() {
  struct rusage usage {};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) * 1024;  // ru_maxrss is in KiB
}

std::string first_file(const FrameRecord& record) {
  return record.files.empty() ? "" : record.files.front().string();
}

/// Draws the bar in the width of the terminal (80 columns if it is unknown), with the estimated
/// time that is left. `elapsed`: seconds since the start.
std::string bar_line(std::size_t done, std::size_t count, double elapsed) {
  struct winsize size {};
  const int columns =
      ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
  const std::string tail = fmt::format(
      " {}/{} frames  {} left", done, count,
      format_seconds(
          done > 0 ? elapsed / static_cast<double>(done) * static_cast<double>(count - done) : 0));
  // The bar has 8 to 40 columns. Three more are for its brackets and an empty last column.
  const auto width =
      static_cast<std::size_t>(std::clamp(columns - static_cast<int>(tail.size()) - 3, 8, 40));
  const std::size_t filled = width * done / std::max<std::size_t>(count, 1);
  return "[" + std::string(filled, '=') + std::string(width - filled, ' ') + "]" + tail;
}

void print_json(std::size_t done, std::size_t count, const FrameRecord& record) {
  JsonValue json{{"frame", record.frame},
                 {"done", done},
                 {"of", count},
                 {"state", state_word(record)},
                 {"seconds", std::round(record.seconds * 1e3) / 1e3},
                 {"file", first_file(record)}};
  if (!record.error.empty()) json["error"] = record.error;
  // One write per line, so that lines of several processes do not mix in a shared log.
  const std::string line = dump_json(json, /*indent=*/-1);
  std::fwrite(line.data(), 1, line.size(), stderr);
}

/// Prints the lines that a session of Open Job Description reads from an action's output (its
/// specification 2023-09, "How Jobs Are Run"). Workers show them beside the task.
void print_openjd(std::size_t done, std::size_t count, const FrameRecord& record) {
  const std::string lines = fmt::format(
      "openjd_progress: {:.1f}\nopenjd_status: frame {} {}, {} of {}\n",
      100 * static_cast<double>(done) / static_cast<double>(std::max<std::size_t>(count, 1)),
      record.frame, state_word(record), done, count);
  std::fwrite(lines.data(), 1, lines.size(), stderr);
}

}  // namespace

void print_openjd_failure(const Error& error) {
  const std::string text = printable(error.message, LineBreaks::kKeep);
  const std::string line = fmt::format("openjd_fail: {}\n", text.substr(0, text.find('\n')));
  std::fwrite(line.data(), 1, line.size(), stderr);
}

ProgressCallback make_progress(ProgressMode mode) {
  return [mode, stopwatch = Stopwatch()](std::size_t done, std::size_t count,
                                         const FrameRecord& record) {
    const double elapsed = stopwatch.seconds();
    switch (mode) {
      case ProgressMode::kBar:
        set_status_line(done < count ? bar_line(done, count, elapsed) : "");
        break;
      case ProgressMode::kJson:
        print_json(done, count, record);
        break;
      case ProgressMode::kOpenJd:
        print_openjd(done, count, record);
        break;
      case ProgressMode::kLines:
        log_info("frame {} {}/{} {:.2f} s, peak memory {}, {}{}{}", record.frame, done, count,
                 record.seconds, format_bytes(peak_memory()), state_word(record),
                 record.files.empty() ? "" : " ", first_file(record));
        break;
      default:  // kNone
        break;
    }
  };
}

Heartbeat::Heartbeat(ProgressMode mode, double seconds, std::size_t frames)
    : mode_(mode), interval_(seconds), frames_(frames) {
  if (seconds > 0 && (mode != ProgressMode::kBar && mode != ProgressMode::kNone))
    thread_ = std::thread([this] { run(); });
}

Heartbeat::~Heartbeat() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Heartbeat::restart(std::size_t done) {
  {
    const std::lock_guard lock(mutex_);
    done_ = done;
    restarted_ = true;
  }
  changed_.notify_all();
}

void Heartbeat::run() {
  auto interval_start = std::chrono::steady_clock::now();
  std::unique_lock lock(mutex_);
  while (!ended_) {
    if (changed_.wait_for(lock, interval_, [this] { return restarted_ || ended_; })) {
      restarted_ = false;
      interval_start = std::chrono::steady_clock::now();
      continue;
    }
    const double frame_seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - interval_start).count();
    if (mode_ == ProgressMode::kJson) {
      const std::string line = dump_json({{"heartbeat", true},
                                          {"done", done_},
                                          {"of", frames_},
                                          {"seconds", std::round(frame_seconds * 10) / 10}},
                                         /*indent=*/-1);
      std::fwrite(line.data(), 1, line.size(), stderr);
    } else {
      log_info("working: {}/{} frames done, {} on this one, peak memory {}", done_, frames_,
               format_seconds(frame_seconds), format_bytes(peak_memory()));
    }
  }
}

}  // namespace polymorph
