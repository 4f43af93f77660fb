// The disk cache of sphere trees: content-addressed, so nothing in it ever becomes stale.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <mutex>
#include <optional>
#include <set>

#include "base/file.h"
#include "base/hash.h"
#include "base/log.h"
#include "spheres/cells.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "cache files are little-endian");

// File: magic, file version, key, node count, nodes, checksum of all before.
constexpr std::string_view kMagic = "polymorph spheres\n";
constexpr std::uint32_t kFileVersion = 2;
constexpr std::size_t kHashSize = 32;
constexpr std::size_t kNodeSize = 4 * 4 + 4 + 2 + 1;
constexpr std::size_t kHeaderSize = kMagic.size() + 4 + kHashSize + 8 + 8;
static_assert(sizeof(Ball) == 11 * sizeof(float));
constexpr std::uint64_t kMostBytes = 4ull << 30;

std::string key_of(const Model& model, const SphereSettings& settings) {
  Hasher hasher;
  hasher.add("spheres").add(kSpheresVersion);
  hasher.add(std::span<const Vec3>(model.points)).add(std::span<const Triangle>(model.triangles));
  // Every field of SphereSettings stands here.
  hasher.add(static_cast<std::uint8_t>(settings.method));
  hasher.add(settings.balls).add(settings.error).add(settings.resolution);
  hasher.add(static_cast<std::uint8_t>(settings.fit));
  hasher.add(static_cast<std::uint8_t>(settings.inside));
  hasher.add(static_cast<std::uint8_t>(settings.solidify ? 1 : 0));
  return hasher.hex();
}

std::string checksum_of(std::string_view bytes) {
  return Hasher().add_bytes(bytes.data(), bytes.size()).hex();
}

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

std::string encode(const Approximation& approximation, const std::string& key) {
  const SphereTree& tree = approximation.tree;
  std::string bytes(kMagic);
  bytes.reserve(kHeaderSize + tree.nodes.size() * kNodeSize + kHashSize);
  put(bytes, kFileVersion);
  bytes += key;
  put(bytes, static_cast<std::uint64_t>(tree.nodes.size()));
  put(bytes, static_cast<std::uint64_t>(approximation.balls.size()));
  for (const SphereNode& node : tree.nodes) {
    put(bytes, node.sphere.center.x);
    put(bytes, node.sphere.center.y);
    put(bytes, node.sphere.center.z);
    put(bytes, node.sphere.radius);
    put(bytes, node.parent);
    put(bytes, node.level);
    put(bytes, static_cast<std::uint8_t>(node.leaf ? 1 : 0));
  }
  for (const Ball& ball : approximation.balls) put(bytes, ball);
  return bytes += checksum_of(bytes);
}

bool is_sound(const SphereTree& tree) {
  bool any_leaf = false;
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    const SphereNode& node = tree.nodes[i];
    const Sphere& s = node.sphere;
    if (!std::isfinite(s.center.x + s.center.y + s.center.z) || !(s.radius > 0) ||
        !std::isfinite(s.radius))
      return false;
    if (node.parent < -1 || node.parent >= static_cast<std::int64_t>(i) || node.level < 0)
      return false;
    any_leaf = any_leaf || node.leaf;
  }
  return any_leaf;
}

/// The tree in a cache file, or what is wrong with the file.
std::optional<Approximation> decode(std::string_view bytes, const std::string& key,
                                    const char*& problem) {
  problem = "is no cache file of this program";
  if (!bytes.starts_with(kMagic) || bytes.size() < kHeaderSize + kHashSize) {
    if (kMagic.starts_with(bytes.substr(0, kMagic.size()))) problem = "is cut short";
    return std::nullopt;
  }
  std::string_view rest = bytes.substr(kMagic.size());
  problem = "has another version";
  if (take<std::uint32_t>(rest) != kFileVersion) return std::nullopt;
  const std::string_view stored_key = rest.substr(0, kHashSize);
  rest.remove_prefix(kHashSize);
  problem = "is cut short or too long";
  const auto count = take<std::uint64_t>(rest);
  const auto ball_count = take<std::uint64_t>(rest);
  if (count > rest.size() / kNodeSize || ball_count > rest.size() / sizeof(Ball) ||
      rest.size() != count * kNodeSize + ball_count * sizeof(Ball) + kHashSize)
    return std::nullopt;
  problem = "is damaged (wrong checksum)";
  if (checksum_of(bytes.substr(0, bytes.size() - kHashSize)) !=
      bytes.substr(bytes.size() - kHashSize))
    return std::nullopt;
  problem = "belongs to another model";
  if (stored_key != key) return std::nullopt;
  Approximation approximation;
  SphereTree& tree = approximation.tree;
  tree.nodes.resize(static_cast<std::size_t>(count));
  for (SphereNode& node : tree.nodes) {
    node.sphere.center.x = take<float>(rest);
    node.sphere.center.y = take<float>(rest);
    node.sphere.center.z = take<float>(rest);
    node.sphere.radius = take<float>(rest);
    node.parent = take<std::int32_t>(rest);
    node.level = take<std::int16_t>(rest);
    node.leaf = take<std::uint8_t>(rest) != 0;
  }
  problem = "holds no sound sphere tree";
  if (!is_sound(tree)) return std::nullopt;
  approximation.balls.resize(static_cast<std::size_t>(ball_count));
  for (Ball& ball : approximation.balls) ball = take<Ball>(rest);
  return approximation;
}

std::optional<Approximation> read_cached(const fs::path& file, const std::string& key) {
  std::error_code error;
  if (!fs::exists(file, error)) return std::nullopt;
  const auto bytes = read_file(file, kMostBytes);
  if (!bytes) {
    log_warning("sphere cache: {} - the spheres are computed anew", bytes.error().message);
    return std::nullopt;
  }
  const char* problem = nullptr;
  auto tree = decode(*bytes, key, problem);
  if (!tree)
    log_warning("sphere cache: {} {} - the spheres are computed anew", file.string(), problem);
  return tree;
}

/// Says once a folder that nothing can be kept there.
void warn_unwritable(const fs::path& folder, const Error& error) {
  static std::mutex mutex;
  static std::set<fs::path> told;
  const std::lock_guard<std::mutex> lock(mutex);
  if (told.insert(folder).second)
    log_warning("sphere cache: {} (going on without it)", error.message);
}

}  // namespace

Result<Approximation> approximate_cached(const Model& model, const SphereSettings& settings,
                                         const fs::path& cache_folder) {
  if (cache_folder.empty()) return approximate(model, settings);
  const std::string key = key_of(model, settings);
  const fs::path file = cache_folder / (key + ".spheres");
  if (auto cached = read_cached(file, key)) return std::move(*cached);
  PM_TRY(Approximation tree, approximate(model, settings));
  // Two processes may get here at once: both write the same bytes, and the later rename wins.
  const Status written = write_file(file, encode(tree, key));
  if (!written) warn_unwritable(cache_folder, written.error());
  return tree;
}

fs::path default_cache_folder() {
  const auto from = [](const char* name) -> fs::path {
    const char* value = std::getenv(name);
    return value && *value ? fs::path(value) : fs::path{};
  };
  if (fs::path own = from("POLYMORPH_CACHE_DIR"); !own.empty()) return own;
  // The XDG base directory specification: relative paths are to be ignored.
  if (fs::path xdg = from("XDG_CACHE_HOME"); xdg.is_absolute()) return xdg / "polymorph";
  if (fs::path home = from("HOME"); home.is_absolute()) return home / ".cache" / "polymorph";
  return {};
}

}  // namespace polymorph
