// Asset lookup: finds the files that an OBJ or MTL file names.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"

namespace polymorph {

struct AssetPath {
  std::filesystem::path path;  ///< an existing file; empty if there is none
  std::string note;            ///< reason why another file than the named one is used; else empty
};

/// Finds the files that a model names; each folder is listed once.
class AssetFinder {
 public:
  /// `root`: the model's folder. `model`: the model's file. If this is a symbolic link, the files
  /// found may also be links into the folder of the link's target, because a model is often linked
  /// together with its MTL.
  explicit AssetFinder(std::filesystem::path root, const std::filesystem::path& model = {});
  /// Finds the file `name` as written: spaces, backslashes and the wrong case are accepted.
  /// `folder` is the folder of the file that names it and lies in `root`. Files outside `root`
  /// (absolute paths, `..`) are never opened, because a downloaded model must not read arbitrary
  /// files. If the named file is outside or missing, a file of the same base name in `folder` or
  /// `root` is used instead, with a note. Links are followed if they lead to files inside `root` or
  /// inside the folder of the model's target. Errors (kInput): the file is outside, or is a link
  /// that leads outside, and there is no other file with its base name. The caller prefixes the
  /// message with file and line.
  Result<AssetPath> find(const std::filesystem::path& folder, std::string_view name);

 private:
  /// Tests whether `path` is a file whose links, if any, end inside `root_` or `linked_`.
  bool is_usable(const std::filesystem::path& path) const;
  /// Resolves `relative` below `folder` regardless of case; empty if there is no such file.
  std::filesystem::path find_any_case(const std::filesystem::path& folder,
                                      const std::filesystem::path& relative);
  /// Lists a folder as a map from names in lower case to the names on disk.
  const std::map<std::string, std::string>& names_in(const std::filesystem::path& folder);

  std::filesystem::path root_;
  std::filesystem::path linked_;  ///< folder of the model's target if it is a link; else empty
  /// Results of names_in() by folder.
  std::map<std::filesystem::path, std::map<std::string, std::string>> folders_;
};

}  // namespace polymorph
