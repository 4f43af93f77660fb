// Files of the sphere cache, with a header and a checksum that are right.
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string_view>

#include "base/log.h"
#include "base/result.h"
#include "spheres/cache.h"

using namespace polymorph;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path folder = [] {
    LogSettings quiet;
    quiet.level = LogLevel::kError;
    PM_CHECK(set_log(quiet));
    return std::filesystem::path("/dev/shm") / ("polymorph-fuzz-" + std::to_string(::getpid()));
  }();
  static const std::string key(kCacheKeySize, '0');
  store_cached(folder, key, kSphereFiles, "", {reinterpret_cast<const char*>(data), size});
  const auto loaded = load_approximation(folder, key);
  if (!loaded) return 0;
  store_approximation(folder, key, "", *loaded);
  const auto again = load_approximation(folder, key);
  PM_CHECK(again && again->balls.size() == loaded->balls.size());
  PM_CHECK(again->tree.nodes.size() == loaded->tree.nodes.size());
  return 0;
}
