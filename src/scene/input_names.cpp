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

/// The part of a file's path behind that of a folder which it lies below.
fs::path behind(const fs::path& folder, const fs::path& file) {
  fs::path rest;
  for (auto part = std::next(file.begin(), std::distance(folder.begin(), folder.end()));
       part != file.end(); ++part)
    rest /= *part;
  return rest;
}

fs::path common_folder(std::span<const fs::path> files) {
  fs::path common = files.front().parent_path();
  for (const fs::path& file : files)
    while (!is_below(common, file)) common = common.parent_path();
  return common;
}

/// Tests whether the names of the files below the folder may be published.
bool is_presentable(const fs::path& root, std::span<const fs::path> files) {
  if (root == root.root_path()) return false;
  return std::none_of(files.begin(), files.end(), [&](const fs::path& file) {
    const fs::path folders = behind(root, file).parent_path();
    return std::any_of(folders.begin(), folders.end(),
                       [](const fs::path& folder) { return is_private_folder(folder.string()); });
  });
}

void add_roots(std::span<const fs::path> files, std::vector<fs::path>& roots) {
  const fs::path root = common_folder(files);
  if (is_presentable(root, files)) {
    roots.push_back(root);
    return;
  }
  std::map<fs::path, std::vector<fs::path>> parts;
  for (const fs::path& file : files) {
    const fs::path rest = behind(root, file);
    // Files in the folder itself are a part of their own.
    parts[rest.has_parent_path() ? root / *rest.begin() : root].push_back(file);
  }
  for (const auto& [folder, part] : parts) {
    if (folder == root)
      roots.push_back(root);
    else
      add_roots(part, roots);
  }
}

}  // namespace

std::string InputNames::name(const fs::path& file) const {
  // The deepest root: a file in a folder of its own may have others below that folder.
  std::size_t best = roots.size();
  for (std::size_t i = 0; i < roots.size(); ++i)
    if (is_below(roots[i], file) && (best == roots.size() || is_below(roots[best], roots[i])))
      best = i;
  if (best == roots.size()) return file.filename().string();
  const std::string name = behind(roots[best], file).generic_string();
  return roots.size() == 1 ? name : fmt::format("{}/{}", best + 1, name);
}

InputNames choose_names(const fs::path& scene_folder, std::span<const fs::path> files) {
  InputNames names;
  if (files.empty()) return names;
  const bool below = std::all_of(files.begin(), files.end(), [&](const fs::path& file) {
    return is_below(scene_folder, file);
  });
  if (below && is_presentable(scene_folder, files))
    names.roots.push_back(scene_folder);
  else
    add_roots(files, names.roots);
  return names;
}

bool is_safe_name(std::string_view name) {
  constexpr std::size_t kMaxLength = 1024;
  if (name.empty() || name.size() > kMaxLength || printable(name) != name) return false;
  const std::vector<std::string> parts = split(name, '/');
  return std::none_of(parts.begin(), parts.end(), [](const std::string& part) {
    return part.empty() || part == "." || part == "..";
  });
}

}  // namespace polymorph
