// Relative names of a scene's files for image headers, without the folders above them.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace polymorph {

/// Root folders that file names are relative to. If there are several, each name begins with the
/// number of its root, from 1: "1/tree.obj".
struct InputNames {
  std::vector<std::filesystem::path> roots;
  /// Returns the name of a file relative to the deepest root above it; without folders if there is
  /// none.
  std::string name(const std::filesystem::path& file) const;
};

/// Chooses the roots of files with absolute paths: the scene's folder if all files lie below it,
/// else their deepest common folder. If this folder is the file system's root, or names would
/// contain a private folder (base/private_paths.h), divides the files into groups and chooses a
/// root for each.
InputNames choose_names(const std::filesystem::path& scene_folder,
                        std::span<const std::filesystem::path> files);

/// Tests whether a file name is relative and stays below its folder.
bool is_safe_name(std::string_view name);

}  // namespace polymorph
