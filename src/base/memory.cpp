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

/// Reads a file of /proc or /sys, whose size is not known in advance.
std::string read_text(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Reduces `min_limit` to the smallest number in files of this name from `folder` up to `root`.
/// "max" is no limit.
void find_min_limit(fs::path folder, const fs::path& root, const char* name,
                    std::optional<std::uint64_t>& min_limit) {
  for (;; folder = folder.parent_path()) {
    const std::string text = read_text(folder / name);
    const auto bytes = parse_integer(text.substr(0, text.find('\n')));
    if (bytes && *bytes > 0)
      min_limit = std::min(min_limit.value_or(std::numeric_limits<std::uint64_t>::max()),
                           static_cast<std::uint64_t>(*bytes));
    if (folder == root || folder == folder.parent_path()) return;
  }
}

/// Memory of this job on this machine according to Slurm; "0" means all of it.
std::optional<std::uint64_t> slurm_memory() {
  const char* mebibytes = std::getenv("SLURM_MEM_PER_NODE");
  const auto value = mebibytes ? parse_integer(mebibytes) : std::nullopt;
  if (!value || *value <= 0) return std::nullopt;
  return static_cast<std::uint64_t>(*value) << 20;
}

}  // namespace

std::optional<std::uint64_t> cgroup_memory_limit(std::string_view membership,
                                                 const fs::path& root) {
  std::optional<std::uint64_t> min_limit;
  // "0::/a/b" of version 2, "4:memory:/a/b" of version 1.
  for (const std::string& line : split(std::string(membership), '\n')) {
    const auto first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::vector<std::string> controllers =
        split(line.substr(first + 1, second - first - 1), ',');
    const fs::path below = fs::path(line.substr(second + 1)).relative_path();
    const auto reduce_to = [&](const fs::path& mount, const char* name) {
      find_min_limit((mount / below).lexically_normal(), mount, name, min_limit);
    };
    if (line.starts_with("0::")) {
      reduce_to(root, "memory.max");
      reduce_to(root / "unified", "memory.max");  // where both versions are mounted
    } else if (std::find(controllers.begin(), controllers.end(), "memory") != controllers.end()) {
      reduce_to(root / "memory", "memory.limit_in_bytes");
    }
  }
  return min_limit;
}

std::uint64_t memory_limit() {
  std::uint64_t min_limit = static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) *
                            static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  const auto reduce_to = [&](std::optional<std::uint64_t> limit) {
    if (limit) min_limit = std::min(min_limit, *limit);
  };
  reduce_to(cgroup_memory_limit(read_text("/proc/self/cgroup"), "/sys/fs/cgroup"));
  reduce_to(slurm_memory());
  struct rlimit space {};
  if (getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_cur != RLIM_INFINITY)
    reduce_to(space.rlim_cur);
  return min_limit;
}

}  // namespace polymorph
