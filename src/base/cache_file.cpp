#include "base/cache_file.h"

#include <bit>
#include <fstream>
#include <mutex>
#include <set>

#include "base/file.h"
#include "base/hash.h"
#include "base/log.h"
#include "base/text.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "cache files are little-endian");

// Layout of a file: magic, version (4 bytes), key, length of the origin (1 byte), origin, content,
// checksum of everything before it.
constexpr std::size_t kHashSize = kCacheKeySize;  // length of the key, and of the checksum
constexpr std::size_t kMaxOrigin = 255;           // maximum length of the origin, in bytes
constexpr std::uint64_t kMaxBytes = 4ull << 30;   // larger files are not loaded

/// Tests whether a name is one that this program gives to cache files.
bool is_key(std::string_view name) {
  return name.size() == kCacheKeySize &&
         name.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

std::string compute_checksum(std::string_view bytes) {
  return Hasher().add_bytes(bytes.data(), bytes.size()).hex();
}

/// Tests whether `file` exists as a directory, a pipe, a socket or a device. Those are left alone,
/// because opening a pipe would wait for its other end.
bool is_special_file(const fs::path& file) {
  std::error_code ignored;
  const fs::file_type type = fs::status(file, ignored).type();
  return type == fs::file_type::directory || type == fs::file_type::fifo ||
         type == fs::file_type::socket || type == fs::file_type::character ||
         type == fs::file_type::block;
}

/// Warns, once per folder, that nothing can be stored there.
void warn_unwritable(const fs::path& folder, const Error& error) {
  static std::mutex mutex;
  static std::set<fs::path> warned;
  const std::lock_guard<std::mutex> lock(mutex);
  if (warned.insert(folder).second) log_warning("cache: {} (going on without it)", error.message);
}

}  // namespace

fs::path cache_path(const fs::path& folder, const std::string& key, const CacheKind& kind) {
  return folder / (key + std::string(kind.extension));
}

std::optional<std::string_view> cached_content(std::string_view bytes, const std::string& key,
                                               const CacheKind& kind, const char*& problem) {
  const std::size_t header_size = kind.magic.size() + 4 + kHashSize + 1;  // without the origin
  // Each test is preceded by the problem that its failure means.
  problem = "is no cache file of this program";
  if (!bytes.starts_with(kind.magic) || bytes.size() < header_size + kHashSize) {
    // The file is a beginning of the magic, or the magic with too few bytes after it.
    if (kind.magic.starts_with(bytes.substr(0, kind.magic.size()))) problem = "is cut short";
    return std::nullopt;
  }
  const std::string_view body = bytes.substr(0, bytes.size() - kHashSize);
  std::string_view remaining = body.substr(kind.magic.size());
  problem = "has another version";
  if (take<std::uint32_t>(remaining) != kind.version) return std::nullopt;
  problem = "is damaged (wrong checksum)";
  if (compute_checksum(body) != bytes.substr(body.size())) return std::nullopt;
  problem = "belongs to another model";
  if (remaining.substr(0, kHashSize) != key) return std::nullopt;
  remaining.remove_prefix(kHashSize);
  const auto origin_size = take<std::uint8_t>(remaining);
  problem = "is cut short";
  if (remaining.size() < origin_size) return std::nullopt;
  return remaining.substr(origin_size);
}

void warn_unusable(const fs::path& folder, const std::string& key, const CacheKind& kind,
                   const char* problem) {
  log_warning("cache: {} {} - the {} are computed anew", cache_path(folder, key, kind).string(),
              problem, kind.name);
}

std::optional<std::string> load_cached(const fs::path& folder, const std::string& key,
                                       const CacheKind& kind) {
  const fs::path file = cache_path(folder, key, kind);
  std::error_code error;
  if (!fs::exists(file, error)) return std::nullopt;
  if (is_special_file(file)) {
    warn_unusable(folder, key, kind, "is a folder, a pipe or a device - remove it");
    return std::nullopt;
  }
  auto bytes = read_file(file, kMaxBytes);
  if (!bytes) {
    log_warning("cache: {} - the {} are computed anew", bytes.error().message, kind.name);
    return std::nullopt;
  }
  const char* problem = nullptr;
  if (!cached_content(*bytes, key, kind, problem)) {
    warn_unusable(folder, key, kind, problem);
    return std::nullopt;
  }
  return std::move(*bytes);
}

void store_cached(const fs::path& folder, const std::string& key, const CacheKind& kind,
                  std::string_view origin, std::string_view content) {
  PM_CHECK(key.size() == kHashSize);
  const fs::path file = cache_path(folder, key, kind);
  if (is_special_file(file)) return;  // load_cached() has warned
  const std::string label = printable(origin.substr(0, kMaxOrigin));
  std::string bytes(kind.magic);
  put(bytes, kind.version);
  bytes += key;
  put(bytes, static_cast<std::uint8_t>(label.size()));
  bytes += label;
  bytes += content;
  bytes += compute_checksum(bytes);
  const Status written = write_file(file, bytes);
  if (!written) warn_unwritable(folder, written.error());
}

CacheLabel cache_label(const fs::path& file) {
  for (const CacheKind* kind : kCacheKinds) {
    if (file.extension() != kind->extension) continue;
    const std::size_t header_size = kind->magic.size() + 4 + kHashSize + 1;  // without the origin
    std::string start(header_size + kMaxOrigin, 0);
    std::ifstream in(file, std::ios::binary);
    in.read(start.data(), static_cast<std::streamsize>(start.size()));
    start.resize(static_cast<std::size_t>(in.gcount()));
    const bool is_cut_short = kind->magic.starts_with(start) && is_key(file.stem().string());
    if (is_cut_short) return {kind, ""};
    if (!start.starts_with(kind->magic)) return {};
    std::string_view remaining = std::string_view(start).substr(kind->magic.size());
    // Files of other versions may have another layout after the version.
    if (start.size() < header_size || take<std::uint32_t>(remaining) != kind->version)
      return {kind, ""};
    remaining.remove_prefix(kHashSize);
    const auto origin_size = take<std::uint8_t>(remaining);
    return {kind, printable(remaining.substr(0, origin_size))};
  }
  return {};
}

}  // namespace polymorph
