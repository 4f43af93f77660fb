#include "testing/paths.h"

// The only file that is compiled for one checkout: a compiler cache serves the others to all.

namespace polymorph {

std::filesystem::path source_dir() { return PM_SOURCE_DIR; }

std::filesystem::path program_path() { return PM_PROGRAM; }

std::filesystem::path shared_cache() {
  return program_path().parent_path() / "test-cache" / "polymorph";
}

}  // namespace polymorph
