#include "base/odd_names.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <vector>

namespace polymorph {
namespace {

constexpr std::string_view kBreaks = "\n\t";  // the characters that make a name odd
/// Separators of the components of a name. Messages may contain a single component: a file in a
/// folder, one frame of a pattern, the value of an option.
constexpr std::string_view kSeparators = "/=,:|#%";

struct OddNames {
  std::atomic<bool> any = false;  ///< `components` is not empty; read without the lock
  std::mutex mutex;
  std::vector<std::string> components;  ///< the longest first, because it may contain a shorter one
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
    const std::string component(name.substr(0, name.find_first_of(kSeparators)));
    name.remove_prefix(std::min(component.size() + 1, name.size()));
    if (component.find_first_of(kBreaks) != std::string::npos &&
        component.find_first_not_of(kBreaks) != std::string::npos &&
        std::find(odd.components.begin(), odd.components.end(), component) == odd.components.end())
      odd.components.push_back(component);
  }
  std::stable_sort(odd.components.begin(), odd.components.end(),
                   [](const std::string& a, const std::string& b) { return a.size() > b.size(); });
  odd.any = true;
}

std::string replace_breaks_of_names(std::string_view text) {
  std::string result(text);
  OddNames& odd = odd_names();
  if (!odd.any) return result;
  const std::lock_guard<std::mutex> lock(odd.mutex);
  for (const std::string& component : odd.components) {
    std::string replacement = component;
    for (char& c : replacement)
      if (kBreaks.find(c) != std::string_view::npos) c = '?';
    for (auto at = result.find(component); at != std::string::npos;
         at = result.find(component, at + replacement.size()))
      result.replace(at, component.size(), replacement);
  }
  return result;
}

}  // namespace polymorph
