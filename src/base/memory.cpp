#include "base/memory.h"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include "base/text.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// Reads a file of /proc or /sys, whose size is not known in advance.
std::string read_text(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Reduces `min_limit` to the smallest number in the files of this name from `folder` up to `root`.
/// The text "max" means no limit.
void reduce_limit(fs::path folder, const fs::path& root, const char* name,
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

/// Returns the memory of this job on this machine according to Slurm, in bytes. Returns nothing if
/// Slurm sets no limit, which it also states as 0.
std::optional<std::uint64_t> slurm_memory() {
  const char* mebibytes = std::getenv("SLURM_MEM_PER_NODE");
  const auto value = mebibytes ? parse_integer(mebibytes) : std::nullopt;
  if (!value || *value <= 0) return std::nullopt;
  return static_cast<std::uint64_t>(*value) << 20;
}

std::atomic<std::uint64_t> budget{0};  // in bytes; 0: no limit

}  // namespace

void set_memory_budget(std::uint64_t bytes) { budget = bytes; }

std::uint64_t remaining_memory() {
  if (budget == 0) return std::numeric_limits<std::uint64_t>::max();
  // The fields are numbers of pages: total, resident, ...
  const std::vector<std::string> fields = split(read_text("/proc/self/statm"), ' ');
  const auto resident = fields.size() > 1 ? parse_integer(fields[1]) : std::nullopt;
  const std::uint64_t resident_bytes = static_cast<std::uint64_t>(resident.value_or(0)) *
                                       static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  return budget > resident_bytes ? budget - resident_bytes : 0;
}

Status raise_stack_limit() {
  constexpr rlim_t kNeeded = rlim_t{1} << 20, kDefault = rlim_t{8} << 20;
  rlimit stack{};
  if (getrlimit(RLIMIT_STACK, &stack) != 0 || stack.rlim_cur >= kNeeded) return Ok{};
  const rlimit raised{std::min(stack.rlim_max, kDefault), stack.rlim_max};
  if (raised.rlim_cur < kNeeded || setrlimit(RLIMIT_STACK, &raised) != 0)
    return make_error(ErrorCode::kResource,
                      "the stack is limited to {} - raise that to {} or more (ulimit -s {})",
                      format_bytes(static_cast<double>(stack.rlim_max)),
                      format_bytes(static_cast<double>(kNeeded)), kNeeded >> 10);
  // Threads that start later take their stack size from this attribute, not from the limit.
  pthread_attr_t attributes;
  if (pthread_getattr_default_np(&attributes) == 0) {
    pthread_attr_setstacksize(&attributes, raised.rlim_cur);
    pthread_setattr_default_np(&attributes);
    pthread_attr_destroy(&attributes);
  }
  return Ok{};
}

std::optional<std::uint64_t> cgroup_memory_limit(std::string_view membership,
                                                 const fs::path& root) {
  std::optional<std::uint64_t> min_limit;
  // Lines are "0::/a/b" in version 2 and "4:memory:/a/b" in version 1.
  for (const std::string& line : split(std::string(membership), '\n')) {
    const auto first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::vector<std::string> controllers =
        split(line.substr(first + 1, second - first - 1), ',');
    const fs::path cgroup = fs::path(line.substr(second + 1)).relative_path();
    const auto reduce_to = [&](const fs::path& mount, const char* name) {
      reduce_limit((mount / cgroup).lexically_normal(), mount, name, min_limit);
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
  struct rlimit address_space {};
  if (getrlimit(RLIMIT_AS, &address_space) == 0 && address_space.rlim_cur != RLIM_INFINITY)
    reduce_to(address_space.rlim_cur);
  return min_limit;
}

}  // namespace polymorph
