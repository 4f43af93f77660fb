#include "base/parallel.h"

#include <sched.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <system_error>
#include <thread>

namespace polymorph {
namespace {

std::unique_ptr<tbb::global_control> thread_limit;
int current_threads = 0;  // 0 = no limit set

int available_threads() {
  cpu_set_t set;
  // The call fails on machines with more CPUs than cpu_set_t can represent.
  int count = sched_getaffinity(/*pid=*/0, sizeof set, &set) == 0
                  ? CPU_COUNT(&set)
                  : static_cast<int>(std::thread::hardware_concurrency());
  // Slurm without cgroups does not restrict the affinity, so obey its variable, too.
  if (const char* cpus = std::getenv("SLURM_CPUS_PER_TASK"))
    if (const int n = std::atoi(cpus); n > 0) count = std::min(count, n);
  return std::max(count, 1);
}

}  // namespace

void set_thread_count(int count) {
  current_threads = count > 0 ? count : available_threads();
  thread_limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                       static_cast<std::size_t>(current_threads));
}

Status check_threads() {
  try {
    std::thread([] {}).join();
    return Ok{};
  } catch (const std::system_error& error) {
    return make_thread_error(error.what());
  }
}

Error make_thread_error(const std::string& reason) {
  return make_error(ErrorCode::kResource,
                    "no thread can be started ({}) - raise the limit on processes (ulimit -u, or "
                    "pids.max of the container) or on memory (ulimit -v), or lower ulimit -s",
                    reason);
}

int thread_count() { return current_threads > 0 ? current_threads : available_threads(); }

}  // namespace polymorph
