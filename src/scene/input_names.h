// Relative names of a scene's files for image headers, without the folders above them.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace polymorph {

/// Root folders that file names are relative to. With several, names begin with the number of their
/// root: "1/tree.obj".
struct InputNames {
  std::vector<std::filesystem::path> roots;
  /// Returns the name of a file relative to its deepest root.
  std::string name(const std::filesystem::path& file) const;
};

/// Chooses the roots of files with absolute paths: the scene's folder if all lie below it, else
/// their deepest common folder. It chooses several if names would begin at the file system's root
/// or contain a private folder (base/private_paths.h).
InputNames choose_names(const std::filesystem::path& scene_folder,
                        std::span<const std::filesystem::path> files);

/// Tests whether a file name is relative and stays below its folder.
bool is_safe_name(std::string_view name);

}  // namespace polymorph
