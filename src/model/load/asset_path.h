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
  std::filesystem::path path;  ///< an existing file; empty: there is none
  std::string note;            ///< what was done when it is not simply the named file; may be empty
};

/// Finds the files that a model names; each folder is listed once.
class AssetFinder {
 public:
  explicit AssetFinder(std::filesystem::path root) : root_(std::move(root)) {}
  /// Finds the file `name` (as written: spaces, back slashes and the wrong case are fine) from
  /// `folder`, which lies in `root`, the OBJ's folder. Files outside `root` (absolute paths, `..`)
  /// are never opened: a downloaded model must not read what it likes. When the named file is
  /// outside or missing, a file of the same base name beside it or in `root` is taken instead, with
  /// a note. Links inside `root` are followed. Errors (kInput): outside, and no such base name; the
  /// message has no file and line in front.
  Result<AssetPath> find(const std::filesystem::path& folder, std::string_view name);

 private:
  std::filesystem::path find_any_case(const std::filesystem::path& folder,
                                      const std::filesystem::path& relative);
  /// Names by what they are in lower case.
  const std::map<std::string, std::string>& names_in(const std::filesystem::path& folder);

  std::filesystem::path root_;
  std::map<std::filesystem::path, std::map<std::string, std::string>> folders_;
};

}  // namespace polymorph
