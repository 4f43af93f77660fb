#include "scene/input_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "base/private_paths.h"
#include "base/text.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

bool is_below(const fs::path& folder, const fs::path& file) {
  return std::mismatch(folder.begin(), folder.end(), file.begin(), file.end()).first ==
         folder.end();
}

/// Returns the path of a file relative to a folder above it.
fs::path relative_to(const fs::path& folder, const fs::path& file) {
  fs::path relative;
  for (auto component = std::next(file.begin(), std::distance(folder.begin(), folder.end()));
       component != file.end(); ++component)
    relative /= *component;
  return relative;
}

fs::path common_folder(std::span<const fs::path> files) {
  fs::path common = files.front().parent_path();
  for (const fs::path& file : files)
    while (!is_below(common, file)) common = common.parent_path();
  return common;
}

/// Tests whether the files' names relative to `root` may be published: `root` is not the root of
/// the file system, and the names contain no private folder.
bool is_publishable(const fs::path& root, std::span<const fs::path> files) {
  if (root == root.root_path()) return false;
  return std::none_of(files.begin(), files.end(), [&](const fs::path& file) {
    const fs::path folders = relative_to(root, file).parent_path();
    return std::any_of(folders.begin(), folders.end(),
                       [](const fs::path& folder) { return is_private_folder(folder.string()); });
  });
}

/// Adds the files' common folder to the roots. If names relative to it may not be published,
/// divides the files by the folders below it and adds roots for each group.
void add_roots(std::span<const fs::path> files, std::vector<fs::path>& roots) {
  const fs::path root = common_folder(files);
  if (is_publishable(root, files)) {
    roots.push_back(root);
    return;
  }
  std::map<fs::path, std::vector<fs::path>> groups;
  for (const fs::path& file : files) {
    const fs::path relative = relative_to(root, file);
    // Files directly in `root` form their own group.
    groups[relative.has_parent_path() ? root / *relative.begin() : root].push_back(file);
  }
  for (const auto& [folder, group] : groups) {
    if (folder == root)
      roots.push_back(root);
    else
      add_roots(group, roots);
  }
}

}  // namespace

std::string InputNames::name(const fs::path& file) const {
  // Roots may lie below each other: find the deepest.
  std::size_t deepest = roots.size();
  for (std::size_t i = 0; i < roots.size(); ++i)
    if (is_below(roots[i], file) && (deepest == roots.size() || is_below(roots[deepest], roots[i])))
      deepest = i;
  if (deepest == roots.size()) return file.filename().string();
  const std::string name = relative_to(roots[deepest], file).generic_string();
  return roots.size() == 1 ? name : fmt::format("{}/{}", deepest + 1, name);
}

InputNames choose_names(const fs::path& scene_folder, std::span<const fs::path> files) {
  InputNames names;
  if (files.empty()) return names;
  const bool all_below = std::all_of(files.begin(), files.end(), [&](const fs::path& file) {
    return is_below(scene_folder, file);
  });
  if (all_below && is_publishable(scene_folder, files))
    names.roots.push_back(scene_folder);
  else
    add_roots(files, names.roots);
  return names;
}

bool is_safe_name(std::string_view name) {
  constexpr std::size_t kMaxLength = 1024;
  if (name.empty() || name.size() > kMaxLength || printable(name) != name) return false;
  const std::vector<std::string> components = split(name, '/');
  return std::none_of(components.begin(), components.end(), [](const std::string& component) {
    return component.empty() || component == "." || component == "..";
  });
}

}  // namespace polymorph
