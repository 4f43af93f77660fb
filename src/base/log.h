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
  ColorMode color = ColorMode::kAuto;  ///< kAuto: colour on a terminal unless NO_COLOR is set
  std::filesystem::path file;          ///< additional log file; empty: none
  bool replace_file = false;           ///< replaces `file`, whatever it contains
};
/// Configures logging. Unless `replace_file` is set, appends to a log file of an earlier run and
/// refuses any other existing file. Errors: kOutput.
Status set_log(const LogSettings& settings);

/// Tests whether a line could not be written to the log file, for instance because the disk is
/// full. If so, an error has been printed. A pipe that its reader has closed does not count.
bool log_file_is_incomplete();

/// Logs a message, unless its level is below LogSettings::level.
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

/// Prints a message regardless of the level, because the user asked for it.
void log_answer(const std::string& message);

/// Sets the status line at the bottom of a terminal, below the log; "" clears it.
void set_status_line(const std::string& line);

}  // namespace polymorph
