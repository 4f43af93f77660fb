// Files of the disk cache. The name of a file is a hash of all inputs of its content (its key), so
// the file never becomes stale. Files are written atomically and have a checksum.
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
  std::string_view extension;  ///< extension of the file's name, with its dot
  std::string_view magic;      ///< first bytes of the file
  std::uint32_t version;       ///< version of the file's layout
};

/// The kinds: balls fitted to models, signed distances of objects, their colour volumes, pacings of
/// legs (leg/pacing.h) and correspondences between objects.
inline constexpr CacheKind kSphereFiles = {"spheres", ".spheres", "polymorph spheres\n", 3};
inline constexpr CacheKind kDistanceFiles = {"distances", ".distances", "polymorph distances\n", 2};
inline constexpr CacheKind kColorFiles = {"colours", ".colors", "polymorph colors\n", 1};
inline constexpr CacheKind kPacingFiles = {"paces", ".pacing", "polymorph pacing\n", 2};
inline constexpr CacheKind kPlanFiles = {"plans", ".plan", "polymorph plan\n", 3};
inline constexpr const CacheKind* kCacheKinds[] = {&kSphereFiles, &kDistanceFiles, &kColorFiles,
                                                   &kPacingFiles, &kPlanFiles};

/// Path of the cache file with this key: FOLDER/KEY.EXTENSION.
std::filesystem::path cache_path(const std::filesystem::path& folder, const std::string& key,
                                 const CacheKind& kind);

/// Returns the content of a cache file, which stands between its header and its checksum. `bytes`:
/// the whole file. If the file is invalid, returns nothing and sets `problem` for warn_unusable().
std::optional<std::string_view> cached_content(std::string_view bytes, const std::string& key,
                                               const CacheKind& kind, const char*& problem);

/// Loads the whole file stored in `folder` under this key; cached_content() finds the content in
/// it. Returns nothing if there is no file. Returns nothing and warns if the file is unreadable,
/// damaged, no cache file, of another version or stored under a wrong name.
std::optional<std::string> load_cached(const std::filesystem::path& folder, const std::string& key,
                                       const CacheKind& kind);

/// Stores a file atomically: a reader sees all of it or nothing. If several processes store the
/// same key, the last one wins; all write the same content. If writing fails, warns once per
/// folder. `origin` holds the names of the source models, for display only.
void store_cached(const std::filesystem::path& folder, const std::string& key,
                  const CacheKind& kind, std::string_view origin, std::string_view content);

/// Kind of a cache file, and the origin stored in it (empty if the file is cut short or of another
/// version). The kind is null if the file is no cache file. A file that is shorter than its magic
/// counts as a cache file if its name is a key.
struct CacheLabel {
  const CacheKind* kind = nullptr;
  std::string origin;
};
/// Reads the label from a file's extension and first bytes, without reading the rest.
CacheLabel cache_label(const std::filesystem::path& file);

/// Warns that a file is not used. `problem` is the predicate of the message: "is cut short".
void warn_unusable(const std::filesystem::path& folder, const std::string& key,
                   const CacheKind& kind, const char* problem);

}  // namespace polymorph
