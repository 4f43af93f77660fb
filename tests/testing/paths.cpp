#include "testing/paths.h"

// The only file of the tests whose object depends on the path of the checkout, so that checkouts
// can share a compiler cache for all other files.

namespace polymorph {

std::filesystem::path source_dir() { return PM_SOURCE_DIR; }

std::filesystem::path program_path() { return PM_PROGRAM; }

std::filesystem::path shared_cache() {
  return program_path().parent_path() / "test-cache" / "polymorph";
}

}  // namespace polymorph
