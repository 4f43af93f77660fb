// Files of the disk cache. Each is named by the hash of everything that its content depends on, so
// none ever becomes stale; it is written whole or not at all, and carries a checksum.
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace polymorph {

/// Length of a key: the hex digits of a Hasher.
inline constexpr std::size_t kCacheKeySize = 32;

/// One kind of cache file. All strings are literals.
struct CacheKind {
  std::string_view name;       ///< what is in it, for messages: "spheres"
  std::string_view extension;  ///< ".spheres"
  std::string_view magic;      ///< first bytes
  std::uint32_t version;       ///< of the file's layout
};

inline constexpr CacheKind kSphereFiles = {"spheres", ".spheres", "polymorph spheres\n", 3};
inline constexpr CacheKind kDistanceFiles = {"distances", ".distances", "polymorph distances\n", 2};
inline constexpr CacheKind kPacingFiles = {"paces", ".pacing", "polymorph pacing\n", 2};
inline constexpr CacheKind kPlanFiles = {"plans", ".plan", "polymorph plan\n", 3};
inline constexpr const CacheKind* kCacheKinds[] = {&kSphereFiles, &kDistanceFiles, &kPacingFiles,
                                                   &kPlanFiles};

std::filesystem::path cache_path(const std::filesystem::path& folder, const std::string& key,
                                 const CacheKind& kind);

/// What a file's bytes hold between header and checksum, or what is wrong with them.
std::optional<std::string_view> cached_content(std::string_view bytes, const std::string& key,
                                               const CacheKind& kind, const char*& problem);

/// What is kept in `folder` under this key, if anything is: the whole file, of which
/// cached_content() shows the part that was stored. A file that is damaged, foreign, of another
/// version or under another's name gives one warning and no content.
std::optional<std::string> load_cached(const std::filesystem::path& folder, const std::string& key,
                                       const CacheKind& kind);

/// Keeps it: a temporary name, then a rename, so that readers see all or nothing, and of several
/// writers the last wins (all write the same). Where nothing can be written, a warning is given
/// once per folder. `origin`: the models that it was made from, for people who list the cache;
/// nothing is found by it.
void store_cached(const std::filesystem::path& folder, const std::string& key,
                  const CacheKind& kind, std::string_view origin, std::string_view content);

/// The kind of cache file that a regular file is by its extension and first bytes (null: none), and
/// the origin that it was stored with, without reading the rest; empty where it has none.
struct CacheLabel {
  const CacheKind* kind = nullptr;
  std::string origin;
};
CacheLabel cache_label(const std::filesystem::path& file);

/// Says that a file is not used, and why.
void warn_unusable(const std::filesystem::path& folder, const std::string& key,
                   const CacheKind& kind, const char* problem);

/// Appends a value's bytes, and takes them off the front.
template <class T>
void put(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}
template <class T>
T take(std::string_view& bytes) {
  T value;
  std::memcpy(&value, bytes.data(), sizeof value);
  bytes.remove_prefix(sizeof value);
  return value;
}

/// The same for many; there are at least `count` of them in `bytes`.
template <class T>
void put_all(std::string& bytes, const std::vector<T>& values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}
template <class T>
std::vector<T> take_all(std::string_view& bytes, std::size_t count) {
  std::vector<T> values(count);
  if (count > 0) std::memcpy(values.data(), bytes.data(), count * sizeof(T));
  bytes.remove_prefix(count * sizeof(T));
  return values;
}

}  // namespace polymorph
