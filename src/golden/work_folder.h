// Temporary folder of a golden test.
#pragma once

#include <stdlib.h>

#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

#include "base/result.h"

namespace polymorph {

/// A temporary folder, which the destructor removes with its contents.
class WorkFolder {
 public:
  /// Makes an empty folder with a unique name. Errors: kOutput.
  static Result<WorkFolder> create() {
    std::string name =
        (std::filesystem::temp_directory_path() / "polymorph-golden-XXXXXX").string();
    if (!::mkdtemp(name.data()))
      return make_error(ErrorCode::kOutput, "{}: cannot make a folder to work in", name);
    return WorkFolder(name);
  }
  WorkFolder(WorkFolder&& other) noexcept { path_.swap(other.path_); }
  WorkFolder& operator=(WorkFolder&& other) = delete;
  ~WorkFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  explicit WorkFolder(std::filesystem::path path) : path_(std::move(path)) {}
  std::filesystem::path path_;
};

}  // namespace polymorph
