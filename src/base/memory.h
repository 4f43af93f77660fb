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

/// Sets the bytes that this process may take (--max-memory); 0: no limit, as in the beginning.
void set_memory_budget(std::uint64_t bytes);
/// Returns the budget less what is resident now; without a budget, the largest number. Readers of
/// files ask it before they allocate what a file only claims to hold.
std::uint64_t remaining_memory();

/// Raises the limit of the stack (ulimit -s) to what this program needs, for this thread and those
/// that start later. Errors: kResource where it must not be raised so far.
Status raise_stack_limit();

/// Finds the smallest limit, in bytes, of the cgroups that `membership`, the text of
/// /proc/self/cgroup, names below `root`, /sys/fs/cgroup: of version 2 (memory.max) and 1
/// (memory.limit_in_bytes), from the process's own cgroup up to the root. A container may see its
/// own cgroup as the root. Returns nothing if there is no limit.
std::optional<std::uint64_t> cgroup_memory_limit(std::string_view membership,
                                                 const std::filesystem::path& root);

}  // namespace polymorph
