// Files out of a folder, a .zip or a .tar, into memory.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include "base/result.h"

namespace polymorph {

/// The regular files of a folder (with its subfolders) or of an archive (zip, tar; packed by gzip,
/// bzip2, xz or zstd) whose path in it `wanted` takes, by that path with "/" between folders.
/// Links are left out; nothing is written anywhere. Errors: kInput for one that cannot be read, or
/// where what is wanted has more than `max_bytes` in all or 100 000 files.
Result<std::map<std::string, std::string>> read_tree(
    const std::filesystem::path& path, const std::function<bool(const std::string&)>& wanted,
    std::size_t max_bytes = std::size_t{1} << 30);

}  // namespace polymorph
