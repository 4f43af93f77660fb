#include "base/cache_file.h"

#include <bit>
#include <mutex>
#include <set>

#include "base/file.h"
#include "base/hash.h"
#include "base/log.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "cache files are little-endian");

// File: magic, version, key, content, checksum of all before.
constexpr std::size_t kHashSize = kCacheKeySize;
constexpr std::uint64_t kMaxBytes = 4ull << 30;

std::string checksum_of(std::string_view bytes) {
  return Hasher().add_bytes(bytes.data(), bytes.size()).hex();
}

/// Says once per folder that nothing can be kept there.
void warn_unwritable(const fs::path& folder, const Error& error) {
  static std::mutex mutex;
  static std::set<fs::path> told;
  const std::lock_guard<std::mutex> lock(mutex);
  if (told.insert(folder).second) log_warning("cache: {} (going on without it)", error.message);
}

}  // namespace

fs::path cache_path(const fs::path& folder, const std::string& key, const CacheKind& kind) {
  return folder / (key + std::string(kind.extension));
}

std::optional<std::string_view> cached_content(std::string_view bytes, const std::string& key,
                                               const CacheKind& kind, const char*& problem) {
  const std::size_t header = kind.magic.size() + 4 + kHashSize;
  problem = "is no cache file of this program";
  if (!bytes.starts_with(kind.magic) || bytes.size() < header + kHashSize) {
    if (kind.magic.starts_with(bytes.substr(0, kind.magic.size()))) problem = "is cut short";
    return std::nullopt;
  }
  const std::string_view body = bytes.substr(0, bytes.size() - kHashSize);
  std::string_view rest = body.substr(kind.magic.size());
  problem = "has another version";
  if (take<std::uint32_t>(rest) != kind.version) return std::nullopt;
  problem = "is damaged (wrong checksum)";
  if (checksum_of(body) != bytes.substr(body.size())) return std::nullopt;
  problem = "belongs to another model";
  if (rest.substr(0, kHashSize) != key) return std::nullopt;
  return rest.substr(kHashSize);
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
                  std::string_view content) {
  PM_CHECK(key.size() == kHashSize);
  std::string bytes(kind.magic);
  put(bytes, kind.version);
  bytes += key;
  bytes += content;
  bytes += checksum_of(bytes);
  const Status written = write_file(cache_path(folder, key, kind), bytes);
  if (!written) warn_unwritable(folder, written.error());
}

}  // namespace polymorph
