// Memory limit of this process: the machine's memory, cgroups, Slurm, ulimit.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>

#include "base/result.h"

namespace polymorph {

/// Returns the minimum, in bytes, of the machine's memory, the limits of the process's cgroups,
/// SLURM_MEM_PER_NODE and RLIMIT_AS.
std::uint64_t memory_limit();

/// Sets the bytes that this process may use (--max-memory); 0, the default, means no limit.
void set_memory_budget(std::uint64_t bytes);
/// Returns the budget minus the resident memory, in bytes; without a budget, the largest number.
/// File readers check it before they allocate memory for a size that a file states.
std::uint64_t remaining_memory();

/// If the stack limit (ulimit -s) is below 1 MiB, raises it to 8 MiB or as far as is permitted, for
/// this thread and those that start later. Errors: kResource if 1 MiB is not permitted.
Status raise_stack_limit();

/// Finds the smallest memory limit, in bytes, of the process's own cgroup and those above it;
/// nothing if there is none. `membership` is the text of /proc/self/cgroup, `root` is
/// /sys/fs/cgroup. Reads memory.max (cgroup version 2) and memory.limit_in_bytes (version 1). A
/// container may see its own cgroup as the root.
std::optional<std::uint64_t> cgroup_memory_limit(std::string_view membership,
                                                 const std::filesystem::path& root);

}  // namespace polymorph
