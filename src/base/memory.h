// The memory that this process may use: of the machine, its cgroup, a Slurm job, ulimit.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>

namespace polymorph {

/// Bytes: the least of the machine's memory, the limits of the cgroups that the process is in,
/// SLURM_MEM_PER_NODE and RLIMIT_AS.
std::uint64_t memory_limit();

/// The least limit in bytes of the cgroups that `membership`, the text of /proc/self/cgroup, names
/// below `root`, /sys/fs/cgroup: of version 2 (memory.max) and 1 (memory.limit_in_bytes), from the
/// process's own up to the root. A container may see its own cgroup as the root. None: no limit.
std::optional<std::uint64_t> cgroup_memory_limit(std::string_view membership,
                                                 const std::filesystem::path& root);

}  // namespace polymorph
