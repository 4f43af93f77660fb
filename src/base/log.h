// Logging to standard error or a log file, and a status line. Standard output is reserved for data.
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <utility>

#include "base/result.h"

namespace polymorph {

enum class LogLevel { kDebug, kInfo, kWarning, kError };
enum class LogFormat { kText, kJson };
enum class ColorMode { kAuto, kAlways, kNever };

struct LogSettings {
  LogLevel level = LogLevel::kInfo;
  LogFormat format = LogFormat::kText;
  ColorMode color = ColorMode::kAuto;  ///< kAuto: a terminal and no NO_COLOR
  std::filesystem::path file;          ///< also written here, when not empty
  bool replace_file = false;           ///< `file` may be replaced, whatever it is
};
/// A log file that an earlier run of this program began is added to; any other file that exists is
/// left alone unless it may be replaced. Errors: kOutput.
Status set_log(const LogSettings& settings);

void log_message(LogLevel level, const std::string& message);

template <class... Args>
void log_debug(fmt::format_string<Args...> text, Args&&... args) {
  log_message(LogLevel::kDebug, fmt::format(text, std::forward<Args>(args)...));
}
template <class... Args>
void log_info(fmt::format_string<Args...> text, Args&&... args) {
  log_message(LogLevel::kInfo, fmt::format(text, std::forward<Args>(args)...));
}
template <class... Args>
void log_warning(fmt::format_string<Args...> text, Args&&... args) {
  log_message(LogLevel::kWarning, fmt::format(text, std::forward<Args>(args)...));
}

/// Says it whatever the level: it was asked for.
void log_answer(const std::string& message);

/// One status line at the foot of a terminal, kept below the log: set it, or clear it with "".
void set_status_line(const std::string& line);

}  // namespace polymorph
