// Files of the disk cache. Each is named by a hash of all inputs of its content, so it never
// becomes stale. Files are written atomically and have a checksum.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "base/bytes.h"

namespace polymorph {

/// Length of a key: the hex digits of a Hasher.
inline constexpr std::size_t kCacheKeySize = 32;

/// One kind of cache file. All strings are literals.
struct CacheKind {
  std::string_view name;       ///< plural noun for messages: "spheres"
  std::string_view extension;  ///< ".spheres"
  std::string_view magic;      ///< first bytes
  std::uint32_t version;       ///< version of the file's layout
};

inline constexpr CacheKind kSphereFiles = {"spheres", ".spheres", "polymorph spheres\n", 3};
inline constexpr CacheKind kDistanceFiles = {"distances", ".distances", "polymorph distances\n", 2};
inline constexpr CacheKind kPacingFiles = {"paces", ".pacing", "polymorph pacing\n", 2};
inline constexpr CacheKind kPlanFiles = {"plans", ".plan", "polymorph plan\n", 3};
inline constexpr const CacheKind* kCacheKinds[] = {&kSphereFiles, &kDistanceFiles, &kPacingFiles,
                                                   &kPlanFiles};

/// Path of the file with this key.
std::filesystem::path cache_path(const std::filesystem::path& folder, const std::string& key,
                                 const CacheKind& kind);

/// Returns the content between a file's header and its checksum. If the file is invalid, returns
/// nothing and sets `problem`.
std::optional<std::string_view> cached_content(std::string_view bytes, const std::string& key,
                                               const CacheKind& kind, const char*& problem);

/// Loads the file stored in `folder` under this key, if there is one; cached_content() gives its
/// content. A file that is damaged, foreign, of another version or under a wrong name gives a
/// warning and nothing.
std::optional<std::string> load_cached(const std::filesystem::path& folder, const std::string& key,
                                       const CacheKind& kind);

/// Stores a file by writing a temporary and renaming it, so that readers see all or nothing; of
/// several writers the last wins (all write the same). If writing fails, a warning is given once
/// per folder. `origin`: names of the source models, for display only.
void store_cached(const std::filesystem::path& folder, const std::string& key,
                  const CacheKind& kind, std::string_view origin, std::string_view content);

/// Kind of a cache file and the origin stored in it. The kind is null if the file is no cache file;
/// one that is too short to tell is a cache file if its name is a key.
struct CacheLabel {
  const CacheKind* kind = nullptr;
  std::string origin;
};
/// Reads the label from a file's extension and first bytes, without reading the rest.
CacheLabel cache_label(const std::filesystem::path& file);

/// Warns that a file is not used, and why.
void warn_unusable(const std::filesystem::path& folder, const std::string& key,
                   const CacheKind& kind, const char* problem);

}  // namespace polymorph
