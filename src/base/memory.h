// Memory limit of this process: the machine's memory, cgroups, Slurm, ulimit.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>

namespace polymorph {

/// Returns the minimum, in bytes, of the machine's memory, the limits of the process's cgroups,
/// SLURM_MEM_PER_NODE and RLIMIT_AS.
std::uint64_t memory_limit();

/// Finds the smallest limit, in bytes, of the cgroups that `membership`, the text of
/// /proc/self/cgroup, names below `root`, /sys/fs/cgroup: of version 2 (memory.max) and 1
/// (memory.limit_in_bytes), from the process's own cgroup up to the root. A container may see its
/// own cgroup as the root. Returns nothing if there is no limit.
std::optional<std::uint64_t> cgroup_memory_limit(std::string_view membership,
                                                 const std::filesystem::path& root);

}  // namespace polymorph
