// Containment of paths in folders.
#pragma once

#include <filesystem>
#include <system_error>

namespace polymorph {

/// Tests whether `path` is `folder` or lies in it, after resolving links. Neither needs to exist.
inline bool is_in_folder(const std::filesystem::path& path, const std::filesystem::path& folder) {
  std::error_code ignored;
  const auto resolve = [&](const std::filesystem::path& p) {
    return std::filesystem::weakly_canonical(
        std::filesystem::absolute(p.empty() ? "." : p, ignored), ignored);
  };
  const std::filesystem::path relative = resolve(path).lexically_relative(resolve(folder));
  return !relative.empty() && *relative.begin() != "..";
}

}  // namespace polymorph
