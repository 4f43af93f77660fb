#include "base/private_paths.h"

#include <cstdlib>
#include <filesystem>

namespace polymorph {
namespace {

std::string_view environment_variable(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

std::string home_name() {
  const std::filesystem::path home(environment_variable("HOME"));
  return (home.has_filename() ? home : home.parent_path()).filename().string();
}

/// Characters that may precede an absolute path within a word, and characters that end the path.
constexpr std::string_view kPathOpeners = "=,:;\"'([{<>| ", kPathClosers = "=,:;\"')]}<>|";

}  // namespace

bool is_private_folder(std::string_view name) {
  return !name.empty() && (name == environment_variable("USER") ||
                           name == environment_variable("LOGNAME") || name == home_name());
}

std::string remove_folders(std::string_view text) {
  std::string result;
  std::size_t at = 0;
  while (at < text.size()) {
    // A path is a word, a value within a word, or the value of a short option: -o/home/ada/f.exr.
    const bool is_path_start =
        text[at] == '/' &&
        (at == 0 || (at == 2 && text[0] == '-' && text[1] != '-' && text[1] != '/') ||
         kPathOpeners.find(text[at - 1]) != std::string_view::npos);
    if (!is_path_start) {
      result += text[at++];
      continue;
    }
    std::string_view path = text.substr(at);
    // A space does not end a path, because names may contain spaces.
    path = path.substr(0, path.find_first_of(kPathClosers));
    at += path.size();
    while (path.size() > 1 && path.ends_with('/')) path.remove_suffix(1);
    const std::string_view name = path.substr(path.find_last_of('/') + 1);
    result += is_private_folder(name) ? "~" : name;
  }
  return result;
}

}  // namespace polymorph
