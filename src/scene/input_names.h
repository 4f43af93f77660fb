// Names of a scene's files for headers: relative, below a folder that may lie anywhere.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace polymorph {

/// Folders that the names of files begin at. With several, each has a number: "1/tree.obj".
struct InputNames {
  std::vector<std::filesystem::path> roots;
  /// The name of a file below one of the roots.
  std::string name(const std::filesystem::path& file) const;
};

/// Chooses the roots of files by their absolute paths: the scene's folder where all lie below it,
/// else their deepest common folder; several where the names would begin at the file system's root
/// or have a private folder in them (base/private_paths.h).
InputNames choose_names(const std::filesystem::path& scene_folder,
                        std::span<const std::filesystem::path> files);

/// Tests whether this is a relative name of a file that stays below its folder.
bool is_safe_name(std::string_view name);

}  // namespace polymorph
