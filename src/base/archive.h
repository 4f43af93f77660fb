// Reading of folders and archives (.zip, .tar) into memory.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include "base/result.h"

namespace polymorph {

/// Reads the regular files of a folder (with its subfolders) or of an archive (zip, tar; compressed
/// with gzip, bzip2, xz or zstd) whose paths satisfy `is_selected`. Returns a map from path to
/// content; paths are relative to the folder or archive, with "/" as the separator. Links are
/// ignored; nothing is written to disk. Errors: kInput if a file or the archive is unreadable, or
/// if the selected files exceed `max_bytes` in total or 100 000 in number.
Result<std::map<std::string, std::string>> read_tree(
    const std::filesystem::path& path, const std::function<bool(const std::string&)>& is_selected,
    std::size_t max_bytes = std::size_t{1} << 30);

}  // namespace polymorph
