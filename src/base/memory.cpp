#include "base/memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>

#include "base/text.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// Files of /proc and /sys have no size to ask for.
std::string text_of(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The least number in files of this name from `folder` up to `root`. "max" is none.
void take_limits(fs::path folder, const fs::path& root, const char* name,
                 std::optional<std::uint64_t>& least) {
  for (;; folder = folder.parent_path()) {
    const std::string text = text_of(folder / name);
    const auto bytes = parse_integer(text.substr(0, text.find('\n')));
    if (bytes && *bytes > 0)
      least = std::min(least.value_or(std::numeric_limits<std::uint64_t>::max()),
                       static_cast<std::uint64_t>(*bytes));
    if (folder == root || folder == folder.parent_path()) return;
  }
}

/// What Slurm gives this job on its machine; "0" is all of it.
std::optional<std::uint64_t> slurm_memory() {
  const char* mebibytes = std::getenv("SLURM_MEM_PER_NODE");
  const auto value = mebibytes ? parse_integer(mebibytes) : std::nullopt;
  if (!value || *value <= 0) return std::nullopt;
  return static_cast<std::uint64_t>(*value) << 20;
}

}  // namespace

std::optional<std::uint64_t> cgroup_memory_limit(std::string_view membership,
                                                 const fs::path& root) {
  std::optional<std::uint64_t> least;
  // "0::/a/b" of version 2, "4:memory:/a/b" of version 1.
  for (const std::string& line : split(std::string(membership), '\n')) {
    const auto first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::vector<std::string> controllers =
        split(line.substr(first + 1, second - first - 1), ',');
    const fs::path below = fs::path(line.substr(second + 1)).relative_path();
    const auto take = [&](const fs::path& mount, const char* name) {
      take_limits((mount / below).lexically_normal(), mount, name, least);
    };
    if (line.starts_with("0::")) {
      take(root, "memory.max");
      take(root / "unified", "memory.max");  // where both versions are mounted
    } else if (std::find(controllers.begin(), controllers.end(), "memory") != controllers.end()) {
      take(root / "memory", "memory.limit_in_bytes");
    }
  }
  return least;
}

std::uint64_t memory_limit() {
  std::uint64_t least = static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) *
                        static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  const auto take = [&](std::optional<std::uint64_t> limit) {
    if (limit) least = std::min(least, *limit);
  };
  take(cgroup_memory_limit(text_of("/proc/self/cgroup"), "/sys/fs/cgroup"));
  take(slurm_memory());
  struct rlimit space {};
  if (getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_cur != RLIM_INFINITY) take(space.rlim_cur);
  return least;
}

}  // namespace polymorph
