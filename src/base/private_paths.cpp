#include "base/private_paths.h"

#include <cstdlib>
#include <filesystem>

namespace polymorph {
namespace {

std::string_view variable(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

std::string home_name() {
  const std::filesystem::path home(variable("HOME"));
  return (home.has_filename() ? home : home.parent_path()).filename().string();
}

/// Characters before an absolute path within a word, and behind it.
constexpr std::string_view kBefore = "=,:;\"'([{<>| ", kBehind = "=,:;\"')]}<>|";

}  // namespace

bool is_private_folder(std::string_view name) {
  return !name.empty() &&
         (name == variable("USER") || name == variable("LOGNAME") || name == home_name());
}

std::string without_folders(std::string_view text) {
  std::string result;
  std::size_t at = 0;
  while (at < text.size()) {
    // A word, a value within a word, or the value of a short option: -o/home/ada/f.exr.
    const bool begins =
        text[at] == '/' &&
        (at == 0 || (at == 2 && text[0] == '-' && text[1] != '-' && text[1] != '/') ||
         kBefore.find(text[at - 1]) != std::string_view::npos);
    if (!begins) {
      result += text[at++];
      continue;
    }
    std::string_view path = text.substr(at);
    // Names may have spaces in them, so that a blank does not end one.
    path = path.substr(0, path.find_first_of(kBehind));
    at += path.size();
    while (path.size() > 1 && path.ends_with('/')) path.remove_suffix(1);
    const std::string_view name = path.substr(path.find_last_of('/') + 1);
    result += is_private_folder(name) ? "~" : name;
  }
  return result;
}

}  // namespace polymorph
