#include "spheres/cache.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "base/file.h"
#include "base/hash.h"
#include "base/log.h"
#include "base/odd_names.h"
#include "spheres/cells.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

// Content of a file: node count, nodes, ball count, balls. Counts have 8 bytes.
constexpr std::size_t kNodeSize = 4 * 4 + 4 + 2 + 1;     // bytes: sphere, parent, level, leaf
constexpr std::size_t kBallSize = 11 * 4;                // bytes: the numbers of for_each_number()
constexpr std::uint64_t kMaxVerifiedBytes = 4ull << 30;  // larger files count as damaged

std::string make_key(const Model& model, const SphereSettings& settings) {
  // Structured bindings make this fail to compile when a member is added. Only the geometry of a
  // model matters.
  const auto& [name, points, triangles, corner_normals, corner_uvs, labels, label_names,
               triangle_materials, materials, textures] = model;
  const auto& [method, balls, error, resolution, root_margin, fit, inside, solidify, coarse] =
      settings;
  Hasher hasher;
  hasher.add("spheres").add(kSpheresVersion);
  hasher.add(std::span<const Vec3>(points)).add(std::span<const Triangle>(triangles));
  hasher.add(static_cast<std::uint8_t>(method))
      .add(balls)
      .add(error)
      .add(resolution)
      .add(root_margin);
  hasher.add(static_cast<std::uint8_t>(fit)).add(static_cast<std::uint8_t>(inside));
  hasher.add(static_cast<std::uint8_t>(solidify ? 1 : 0));
  // Only if true, so that without it keys stay what they were before the setting existed.
  if (coarse) hasher.add("coarse");
  return hasher.hex();
}

/// Calls f for each number of a ball, in file order.
template <class B, class F>
void for_each_number(B& ball, const F& f) {
  for (auto* number :
       {&ball.center.x, &ball.center.y, &ball.center.z, &ball.a, &ball.w, &ball.shape.xx,
        &ball.shape.yy, &ball.shape.zz, &ball.shape.xy, &ball.shape.xz, &ball.shape.yz})
    f(*number);
}

std::string encode(const Approximation& approximation) {
  std::string bytes;
  put(bytes, static_cast<std::uint64_t>(approximation.tree.nodes.size()));
  for (const SphereNode& node : approximation.tree.nodes) {
    put(bytes, node.sphere.center.x);
    put(bytes, node.sphere.center.y);
    put(bytes, node.sphere.center.z);
    put(bytes, node.sphere.radius);
    put(bytes, node.parent);
    put(bytes, node.level);
    put(bytes, static_cast<std::uint8_t>(node.leaf ? 1 : 0));
  }
  put(bytes, static_cast<std::uint64_t>(approximation.balls.size()));
  for (const Ball& ball : approximation.balls)
    for_each_number(ball, [&](float number) { put(bytes, number); });
  return bytes;
}

bool is_valid(const Approximation& approximation) {
  bool has_leaf = false;
  const std::vector<SphereNode>& nodes = approximation.tree.nodes;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const SphereNode& node = nodes[i];
    const Sphere& s = node.sphere;
    if (!std::isfinite(s.center.x + s.center.y + s.center.z) || !(s.radius > 0) ||
        !std::isfinite(s.radius))
      return false;
    if (node.parent < -1 || node.parent >= static_cast<std::int64_t>(i) || node.level < 0)
      return false;
    has_leaf = has_leaf || node.leaf;
  }
  for (const Ball& ball : approximation.balls) {
    bool finite = true;
    for_each_number(ball, [&](float number) { finite = finite && std::isfinite(number); });
    if (!finite || !(ball.a > 0) || !(determinant(ball.shape) > 0)) return false;
  }
  return has_leaf;
}

/// Decodes a cache file; `problem` describes why that failed.
std::optional<Approximation> decode(std::string_view bytes, const std::string& key,
                                    const char*& problem) {
  const auto content = cached_content(bytes, key, kSphereFiles, problem);
  if (!content) return std::nullopt;
  std::string_view remaining = *content;
  problem = "is cut short or too long";
  if (remaining.size() < 16) return std::nullopt;  // two counts
  const auto nodes = take<std::uint64_t>(remaining);
  if (nodes > remaining.size() / kNodeSize || remaining.size() - nodes * kNodeSize < 8)
    return std::nullopt;
  std::string_view ball_bytes = remaining.substr(nodes * kNodeSize);
  const auto balls = take<std::uint64_t>(ball_bytes);
  if (balls > ball_bytes.size() / kBallSize || ball_bytes.size() != balls * kBallSize)
    return std::nullopt;
  Approximation approximation;
  approximation.tree.nodes.resize(static_cast<std::size_t>(nodes));
  for (SphereNode& node : approximation.tree.nodes) {
    node.sphere.center.x = take<float>(remaining);
    node.sphere.center.y = take<float>(remaining);
    node.sphere.center.z = take<float>(remaining);
    node.sphere.radius = take<float>(remaining);
    node.parent = take<std::int32_t>(remaining);
    node.level = take<std::int16_t>(remaining);
    node.leaf = take<std::uint8_t>(remaining) != 0;
  }
  approximation.balls.resize(static_cast<std::size_t>(balls));
  for (Ball& ball : approximation.balls)
    for_each_number(ball, [&](float& number) { number = take<float>(ball_bytes); });
  problem = "holds no sound sphere tree";
  if (!is_valid(approximation)) return std::nullopt;
  return approximation;
}

/// Removes the files of the entries i for which is_removed(i) is true. Counts the removed files,
/// and the others as kept.
template <class F>
CacheCleaning remove_entries(const std::vector<CacheEntry>& entries, const F& is_removed) {
  CacheCleaning cleaning;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    bool is_gone = is_removed(i);
    if (is_gone) {
      std::error_code error;
      fs::remove(entries[i].file, error);  // it is no error if another process was faster
      if (error) {
        cleaning.failures.push_back(
            fmt::format("{}: cannot be removed ({})", entries[i].file.string(), error.message()));
        is_gone = false;
      }
    }
    (is_gone ? cleaning.removed : cleaning.kept) += 1;
    (is_gone ? cleaning.removed_bytes : cleaning.kept_bytes) += entries[i].bytes;
  }
  return cleaning;
}

}  // namespace

std::optional<Approximation> load_approximation(const fs::path& folder, const std::string& key) {
  const auto bytes = load_cached(folder, key, kSphereFiles);
  if (!bytes) return std::nullopt;
  const char* problem = nullptr;
  auto approximation = decode(*bytes, key, problem);
  if (!approximation) warn_unusable(folder, key, kSphereFiles, problem);
  return approximation;
}

void store_approximation(const fs::path& folder, const std::string& key, std::string_view origin,
                         const Approximation& approximation) {
  store_cached(folder, key, kSphereFiles, origin, encode(approximation));
}

std::vector<CacheEntry> list_cache(const fs::path& folder) {
  std::vector<CacheEntry> entries;
  std::error_code error;
  if (!fs::exists(folder, error)) return entries;
  const auto now = fs::file_time_type::clock::now();
  fs::directory_iterator files(folder, error);
  for (; !error && files != fs::directory_iterator(); files.increment(error)) {
    const fs::path& file = files->path();
    std::error_code file_error;
    if (!fs::is_regular_file(files->symlink_status(file_error))) continue;
    CacheLabel label = cache_label(file);
    if (!label.kind) continue;
    CacheEntry entry;
    entry.file = file;
    entry.key = file.stem().string();
    // Anyone may have put a file there whose name contains line breaks, and lists print it.
    remember_name(entry.key);
    entry.kind = label.kind;
    entry.origin = std::move(label.origin);
    entry.bytes = fs::file_size(file, file_error);
    if (file_error) continue;  // just removed by another process
    const auto written = fs::last_write_time(file, file_error);
    if (file_error) continue;
    entry.age = std::max(0.0, std::chrono::duration<double>(now - written).count());
    entries.push_back(std::move(entry));
  }
  if (error) log_warning("cache: {}: cannot be read ({})", folder.string(), error.message());
  std::sort(entries.begin(), entries.end(),
            [](const CacheEntry& a, const CacheEntry& b) { return a.file < b.file; });
  return entries;
}

std::vector<CacheEntry> verify_cache(const fs::path& folder) {
  std::vector<CacheEntry> entries = list_cache(folder);
  for (CacheEntry& entry : entries) {
    const auto bytes = read_file(entry.file, kMaxVerifiedBytes);
    if (!bytes) {
      entry.problem = bytes.error().message;
      continue;
    }
    const char* problem = nullptr;
    if (entry.kind != &kSphereFiles) {
      if (!cached_content(*bytes, entry.key, *entry.kind, problem)) entry.problem = problem;
    } else if (const auto approximation = decode(*bytes, entry.key, problem)) {
      entry.spheres = approximation->tree.leaves().size();
      entry.balls = approximation->balls.size();
    } else {
      entry.problem = problem;
    }
  }
  return entries;
}

CacheCleaning trim_cache(const fs::path& folder, std::uint64_t max_bytes, double max_age) {
  const std::vector<CacheEntry> entries = list_cache(folder);
  std::vector<std::size_t> youngest_first(entries.size());
  for (std::size_t i = 0; i < entries.size(); ++i) youngest_first[i] = i;
  std::stable_sort(youngest_first.begin(), youngest_first.end(),
                   [&](std::size_t a, std::size_t b) { return entries[a].age < entries[b].age; });
  std::vector<std::uint8_t> is_removed(entries.size(), 0);
  std::uint64_t total = 0;
  bool full = false;
  for (const std::size_t i : youngest_first) {
    full = full || entries[i].bytes > max_bytes - total;  // all older files are removed too
    is_removed[i] = full || entries[i].age > max_age;
    if (!is_removed[i]) total += entries[i].bytes;
  }
  return remove_entries(entries, [&](std::size_t i) { return is_removed[i] != 0; });
}

CacheCleaning clear_cache(const fs::path& folder) {
  return remove_entries(list_cache(folder), [](std::size_t) { return true; });
}

Result<Approximation> approximate_cached(const Model& model, const SphereSettings& settings,
                                         const fs::path& cache_folder,
                                         const std::optional<Model>* proxy) {
  if (cache_folder.empty()) return approximate(model, settings, proxy);
  const std::string key = make_key(model, settings);
  if (auto cached = load_approximation(cache_folder, key)) return std::move(*cached);
  PM_TRY(Approximation approximation, approximate(model, settings, proxy));
  store_approximation(cache_folder, key, model.name, approximation);
  return approximation;
}

Result<std::vector<Ball>> refit_cached(const Model& model, const SphereSettings& settings,
                                       const std::vector<Ball>& balls,
                                       const fs::path& cache_folder) {
  if (cache_folder.empty()) return refit(model, settings, balls);
  Hasher hasher;
  hasher.add("refit").add(make_key(model, settings));
  for (const Ball& ball : balls) for_each_number(ball, [&](float number) { hasher.add(number); });
  const std::string key = hasher.hex();
  if (auto cached = load_approximation(cache_folder, key)) return std::move(cached->balls);
  Approximation refitted;
  PM_TRY(refitted.balls, refit(model, settings, balls));
  // The file must have a sphere tree: it gets one sphere per ball, with the radius at which a lone
  // ball's field is 1. A ball of w < 1 gets the radius of w = 1, because radii must be above 0.
  for (const Ball& ball : refitted.balls)
    refitted.tree.nodes.push_back({{ball.center, std::sqrt(std::max(ball.w, 1.0f) / ball.a)},
                                   /*parent=*/-1,
                                   /*level=*/0,
                                   /*leaf=*/true});
  store_approximation(cache_folder, key, model.name, refitted);
  return std::move(refitted.balls);
}

bool is_cached(const Model& model, const SphereSettings& settings, const fs::path& cache_folder) {
  return !cache_folder.empty() &&
         load_approximation(cache_folder, make_key(model, settings)).has_value();
}

fs::path default_cache_folder() {
  const auto read_path = [](const char* name) -> fs::path {
    const char* value = std::getenv(name);
    return value && *value ? fs::path(value) : fs::path{};
  };
  if (fs::path chosen = read_path("POLYMORPH_CACHE_DIR"); !chosen.empty()) return chosen;
  // The XDG base directory specification: relative paths are to be ignored.
  if (fs::path xdg = read_path("XDG_CACHE_HOME"); xdg.is_absolute()) return xdg / "polymorph";
  if (fs::path home = read_path("HOME"); home.is_absolute()) return home / ".cache" / "polymorph";
  return {};
}

}  // namespace polymorph
