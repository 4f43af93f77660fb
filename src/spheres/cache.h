// The disk cache: approximations by spheres, and what else is kept there (base/cache_file.h).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/cache_file.h"
#include "spheres/spheres.h"

namespace polymorph {

/// Part of the cache key. Raise it whenever approximate() may answer differently for the same model
/// and settings; the test Cache.DigestsArePinned says when.
inline constexpr std::uint32_t kSpheresVersion = 10;

/// What is kept in `folder` under this key, if anything is. A file that is damaged, foreign, of
/// another version or under another's name gives one warning and no approximation.
std::optional<Approximation> load_approximation(const std::filesystem::path& folder,
                                                const std::string& key);

/// Keeps it: a temporary name, then a rename, so that readers see all or nothing, and of several
/// writers the last wins (all write the same). Where nothing can be written, a warning is given
/// once per folder. `origin`: the model's name, for people (base/cache_file.h).
void store_approximation(const std::filesystem::path& folder, const std::string& key,
                         std::string_view origin, const Approximation& approximation);

struct CacheEntry {
  std::filesystem::path file;
  std::string key;  ///< as its name says
  const CacheKind* kind = nullptr;
  std::string origin;       ///< the models that it was made from; empty in damaged and old files
  std::uint64_t bytes = 0;  ///< its size
  double age = 0;           ///< seconds since it was written
  std::size_t spheres = 0;  ///< leaves; verify_cache() only, of spheres
  std::size_t balls = 0;    ///< verify_cache() only
  std::string problem;      ///< verify_cache() only; empty = sound
};

/// The files of this program in `folder`, in order of name: regular files *.spheres,
/// *.distances, *.pacing and *.plan that begin with our magic (links are not followed, nothing else
/// is touched). No folder: none. A folder that cannot be read is one warning.
std::vector<CacheEntry> list_cache(const std::filesystem::path& folder);

/// list_cache(), with every file read and checked.
std::vector<CacheEntry> verify_cache(const std::filesystem::path& folder);

struct CacheCleaning {
  std::size_t removed = 0, kept = 0;  ///< files
  std::uint64_t removed_bytes = 0, kept_bytes = 0;
  std::vector<std::string> failures;  ///< what could not be removed, and why
};

/// Removes what is older than `max_age` seconds, then the oldest until at most `max_bytes` are
/// left.
CacheCleaning gc_cache(const std::filesystem::path& folder, std::uint64_t max_bytes,
                       double max_age);
/// Removes all of list_cache().
CacheCleaning clear_cache(const std::filesystem::path& folder);

}  // namespace polymorph
