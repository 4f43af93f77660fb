// Disk cache of sphere approximations. Also lists and removes cached files of all kinds
// (base/cache_file.h).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/cache_file.h"
#include "spheres/spheres.h"

namespace polymorph {

/// Part of the cache key. Increment it whenever approximate() may give a different result for the
/// same model and settings; the test Cache.DigestsArePinned detects that.
inline constexpr std::uint32_t kSpheresVersion = 12;

/// Loads the approximation stored in `folder` under this key, if there is one. For a file that is
/// damaged, foreign, of another version or under a wrong name it logs a warning and returns
/// nullopt.
std::optional<Approximation> load_approximation(const std::filesystem::path& folder,
                                                const std::string& key);

/// Stores an approximation by writing a temporary file and renaming it, so that readers never see
/// half a file; of several writers the last wins (all write the same). If writing fails, it logs a
/// warning once per folder. `origin`: the model's name, for display (base/cache_file.h).
void store_approximation(const std::filesystem::path& folder, const std::string& key,
                         std::string_view origin, const Approximation& approximation);

/// A file of the cache.
struct CacheEntry {
  std::filesystem::path file;
  std::string key;  ///< the key in the file's name
  const CacheKind* kind = nullptr;
  std::string origin;       ///< names of the source models; empty in damaged and old files
  std::uint64_t bytes = 0;  ///< file size
  double age = 0;           ///< seconds since it was written
  std::size_t spheres = 0;  ///< leaves of the sphere tree; verify_cache() only, for sphere files
  std::size_t balls = 0;    ///< verify_cache() only
  std::string problem;      ///< verify_cache() only; empty if the file is valid
};

/// Lists this program's files in `folder`, ordered by name: regular files *.spheres, *.distances,
/// *.pacing and *.plan that begin with our magic number (links are not followed, other files are
/// ignored). A missing folder gives an empty list, an unreadable one a warning.
std::vector<CacheEntry> list_cache(const std::filesystem::path& folder);

/// Lists the files as list_cache() does, and reads and checks each.
std::vector<CacheEntry> verify_cache(const std::filesystem::path& folder);

struct CacheCleaning {
  std::size_t removed = 0, kept = 0;  ///< files
  std::uint64_t removed_bytes = 0, kept_bytes = 0;
  std::vector<std::string> failures;  ///< files that could not be removed, with the reason
};

/// Removes files older than `max_age` seconds, then the oldest until at most `max_bytes` remain.
CacheCleaning trim_cache(const std::filesystem::path& folder, std::uint64_t max_bytes,
                         double max_age);
/// Removes all files that list_cache() lists.
CacheCleaning clear_cache(const std::filesystem::path& folder);

}  // namespace polymorph
