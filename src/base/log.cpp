#include "base/log.h"

#include <fcntl.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <mutex>

#include "base/file.h"
#include "base/text.h"

namespace polymorph {
namespace {

/// Sink for standard error with a status line below the log, so that messages do not break the
/// progress bar.
class TerminalSink : public spdlog::sinks::base_sink<std::mutex> {
 public:
  void set_status(const std::string& line) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (line == status_) return;
    status_ = line;
    draw("");
  }
  bool color = false;
  bool json = false;

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const std::string_view text(message.payload.data(), message.payload.size());
    draw(json ? json_line(message.level, text) : text_line(message.level, text));
  }
  void flush_() override { std::fflush(stderr); }

 private:
  std::string text_line(spdlog::level::level_enum level, std::string_view text) const {
    switch (level) {
      case spdlog::level::warn:
        return fmt::format("{} {}\n", paint("33", "warning:"), text);
      case spdlog::level::err:
        return fmt::format("{} {}\n", paint("31", "error:"), text);
      default:
        return fmt::format("{}\n", text);
    }
  }
  /// Makes a text bold and coloured: code 31 is red, 33 is yellow (ECMA-48).
  std::string paint(const char* code, const char* text) const {
    return color ? fmt::format("\x1b[1;{}m{}\x1b[0m", code, text) : text;
  }
  static std::string json_line(spdlog::level::level_enum level, std::string_view text) {
    return fmt::format("{{\"level\":\"{}\",\"message\":\"{}\"}}\n",
                       spdlog::level::to_string_view(level), escape_json(text));
  }
  /// Prints whole lines above the status line, and the status line again.
  void draw(const std::string& text) {
    if (is_drawn_) std::fputs("\r\x1b[K", stderr);  // erase the status line
    std::fwrite(text.data(), 1, text.size(), stderr);
    std::fwrite(status_.data(), 1, status_.size(), stderr);
    is_drawn_ = !status_.empty();
    std::fflush(stderr);
  }
  std::string status_;
  bool is_drawn_ = false;  ///< the terminal shows a status line
};

std::shared_ptr<TerminalSink> terminal() {
  static auto sink = std::make_shared<TerminalSink>();
  return sink;
}

spdlog::logger& logger() {
  static spdlog::logger instance("polymorph", terminal());
  return instance;
}

spdlog::level::level_enum to_spdlog(LogLevel level) {
  switch (level) {
    case LogLevel::kDebug:
      return spdlog::level::debug;
    case LogLevel::kInfo:
      return spdlog::level::info;
    case LogLevel::kWarning:
      return spdlog::level::warn;
    case LogLevel::kError:
      return spdlog::level::err;
  }
  return spdlog::level::info;
}

/// Patterns of a log file's lines (spdlog's syntax), and the beginnings of such lines, in which 0
/// stands for any digit.
constexpr const char* kTextPattern = "%Y-%m-%dT%H:%M:%S.%e %l %v";
constexpr const char* kJsonPattern =
    R"({"time":"%Y-%m-%dT%H:%M:%S.%e","level":"%l","message":"%v"})";
constexpr std::array<std::string_view, 2> kBeginnings{"0000-00-00T00:00:00.000 ",
                                                      R"({"time":"0000-00-00T00:00:00.000",)"};

/// Tests whether `text` begins with `pattern`, in which 0 stands for any digit.
bool matches(std::string_view text, std::string_view pattern) {
  if (text.size() < pattern.size()) return false;
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    const bool is_digit = std::isdigit(static_cast<unsigned char>(text[i])) != 0;
    if (pattern[i] == '0' ? !is_digit : text[i] != pattern[i]) return false;
  }
  return true;
}

/// Tests whether a file begins as the logs of this program do.
bool looks_like_log(const std::filesystem::path& path) {
  std::string start(64, 0);  // longer than both beginnings
  std::ifstream in(path, std::ios::binary);
  in.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(in.gcount()));
  // An empty file counts as a log, too.
  return start.empty() || std::any_of(kBeginnings.begin(), kBeginnings.end(),
                                      [&](auto pattern) { return matches(start, pattern); });
}

std::atomic<bool> file_is_incomplete{false};

/// Sink for a log file. After the first line that cannot be written, it reports an error on
/// standard error and writes no more.
class FileSink : public spdlog::sinks::base_sink<std::mutex> {
 public:
  FileSink(std::filesystem::path path, int fd, bool json)
      : path_(std::move(path)), fd_(fd), json_(json) {
    set_pattern_(json ? kJsonPattern : kTextPattern);
  }
  ~FileSink() override { ::close(fd_); }
  FileSink(const FileSink&) = delete;
  FileSink& operator=(const FileSink&) = delete;

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    if (stopped_) return;
    spdlog::details::log_msg copy = message;
    std::string escaped;
    if (json_) {
      escaped = escape_json(std::string_view(message.payload.data(), message.payload.size()));
      copy.payload = escaped;
    }
    spdlog::memory_buf_t line;
    formatter_->format(copy, line);
    for (std::size_t done = 0; done < line.size() && !stopped_;) {
      const ssize_t n = ::write(fd_, line.data() + done, line.size() - done);
      if (n > 0)
        done += static_cast<std::size_t>(n);
      else if (n == 0 || errno != EINTR)
        stop(n == 0 ? EIO : errno);
    }
  }
  void flush_() override {}

 private:
  void stop(int errno_value) {
    stopped_ = true;
    if (errno_value == EPIPE) return;  // its reader has closed the pipe
    file_is_incomplete = true;
    terminal()->log({"polymorph", spdlog::level::err,
                     fmt::format("{}: cannot write the log: {} - the run goes on without it",
                                 path_.string(), std::strerror(errno_value))});
  }

  std::filesystem::path path_;
  int fd_;
  bool json_;
  bool stopped_ = false;
};

Status open_log_file(const LogSettings& settings) {
  const std::filesystem::path& path = settings.file;
  struct stat info {};
  const bool exists = ::stat(path.c_str(), &info) == 0;
  const bool is_regular = exists && S_ISREG(info.st_mode);
  if (is_regular && !settings.replace_file && !looks_like_log(path))
    return make_error(ErrorCode::kOutput,
                      "{}: exists and is no log of this program - add --overwrite to replace it",
                      path.string());
  PM_TRY_STATUS(check_writable(path));
  std::error_code ignored;  // opening the file reports the error
  if (!exists && path.has_parent_path())
    std::filesystem::create_directories(path.parent_path(), ignored);
  // O_NONBLOCK: opening a pipe must not wait for a reader.
  const int fd = ::open(path.c_str(),
                        O_WRONLY | O_CREAT | O_APPEND | O_NONBLOCK | O_CLOEXEC |
                            (is_regular && settings.replace_file ? O_TRUNC : 0),
                        0666);
  if (fd < 0 && errno == ENXIO)
    return make_error(ErrorCode::kOutput,
                      "{}: cannot write the log: nobody reads this pipe - start its reader first",
                      path.string());
  if (fd < 0)
    return make_error(ErrorCode::kOutput, "{}: cannot write the log: {}", path.string(),
                      std::strerror(errno));
  ::fcntl(fd, F_SETFL, O_APPEND);  // clears O_NONBLOCK: writing waits while a pipe is full
  logger().sinks().push_back(
      std::make_shared<FileSink>(path, fd, settings.format == LogFormat::kJson));
  return Ok{};
}

/// Shortens lines of more than kMax bytes to their first kFirst and last kLast bytes: a broken file
/// may contain names of megabytes.
std::string shorten_lines(const std::string& text) {
  constexpr std::size_t kMax = 4000, kFirst = 1000, kLast = 300;
  if (text.size() <= kMax) return text;
  std::string result;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    if (end - begin <= kMax)
      result += text.substr(begin, end - begin);
    else
      result += fmt::format("{} [{} characters more] {}", text.substr(begin, kFirst),
                            end - begin - kFirst - kLast, text.substr(end - kLast, kLast));
    if (end < text.size()) result += '\n';
    begin = end + 1;
  }
  // The cut may have split a UTF-8 sequence.
  return printable(result, LineBreaks::kKeep);
}

}  // namespace

Status set_log(const LogSettings& settings) {
  // https://no-color.org: any non-empty value switches colour off.
  const char* no_color = std::getenv("NO_COLOR");
  const bool allows_color = isatty(2) != 0 && !(no_color && *no_color);
  terminal()->color =
      settings.color == ColorMode::kAlways || (settings.color == ColorMode::kAuto && allows_color);
  terminal()->json = settings.format == LogFormat::kJson;
  logger().set_level(to_spdlog(settings.level));
  if (!settings.file.empty()) return open_log_file(settings);
  return Ok{};
}

bool log_file_is_incomplete() { return file_is_incomplete; }

void log_message(LogLevel level, const std::string& message) {
  logger().log(to_spdlog(level), "{}", shorten_lines(printable(message, LineBreaks::kKeep)));
}

void log_answer(const std::string& message) {
  // Log to the sinks directly: only the logger filters by level.
  const std::string text = printable(message, LineBreaks::kKeep);
  for (const auto& sink : logger().sinks())
    sink->log(spdlog::details::log_msg("polymorph", spdlog::level::info, text));
}

void set_status_line(const std::string& line) { terminal()->set_status(line); }

}  // namespace polymorph
