#include "base/odd_names.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <vector>

namespace polymorph {
namespace {

constexpr std::string_view kBreaks = "\n\t";
/// Messages may contain a part of a given name: a file in a folder, one frame of a pattern, the
/// value of an option.
constexpr std::string_view kSeparators = "/=,:|#%";

struct OddNames {
  std::atomic<bool> any = false;
  std::mutex mutex;
  std::vector<std::string> parts;  ///< the longest first
};
OddNames& odd_names() {
  static OddNames all;
  return all;
}

}  // namespace

void remember_name(std::string_view name) {
  if (name.find_first_of(kBreaks) == std::string_view::npos) return;
  OddNames& odd = odd_names();
  const std::lock_guard<std::mutex> lock(odd.mutex);
  while (!name.empty()) {
    const std::string part(name.substr(0, name.find_first_of(kSeparators)));
    name.remove_prefix(std::min(part.size() + 1, name.size()));
    if (part.find_first_of(kBreaks) != std::string::npos &&
        part.find_first_not_of(kBreaks) != std::string::npos &&
        std::find(odd.parts.begin(), odd.parts.end(), part) == odd.parts.end())
      odd.parts.push_back(part);
  }
  std::stable_sort(odd.parts.begin(), odd.parts.end(),
                   [](const std::string& a, const std::string& b) { return a.size() > b.size(); });
  odd.any = true;
}

std::string replace_breaks_of_names(std::string_view text) {
  std::string result(text);
  OddNames& odd = odd_names();
  if (!odd.any) return result;
  const std::lock_guard<std::mutex> lock(odd.mutex);
  for (const std::string& part : odd.parts) {
    std::string shown = part;
    for (char& c : shown)
      if (kBreaks.find(c) != std::string_view::npos) c = '?';
    for (auto at = result.find(part); at != std::string::npos;
         at = result.find(part, at + shown.size()))
      result.replace(at, part.size(), shown);
  }
  return result;
}

}  // namespace polymorph
