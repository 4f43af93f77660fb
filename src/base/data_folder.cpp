#include "base/data_folder.h"

#include <cstdlib>
#include <string>
#include <system_error>
#include <vector>

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// Lists the folders that may be the data folder. Empty: the program's own path is unknown.
std::vector<fs::path> candidates() {
  if (const char* path = std::getenv("POLYMORPH_DATA_DIR"); path && *path) return {path};
  std::error_code error;
  const fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
  if (error) return {};
  return {folder / "share" / "polymorph", folder.parent_path() / "share" / "polymorph"};
}

}  // namespace

Result<fs::path> find_data_folder() {
  std::string failures;
  for (const fs::path& path : candidates()) {
    std::error_code error;
    const fs::path folder = fs::canonical(path, error);
    if (!error && fs::is_directory(folder / "models", error)) return folder;
    failures += fmt::format("\n  {}: {}", path.string(),
                            error ? error.message() : std::string("has no models/"));
  }
  return make_error(ErrorCode::kResource,
                    "cannot find the models that come with polymorph - install them, or name "
                    "their folder in POLYMORPH_DATA_DIR; tried:{}",
                    failures.empty() ? " nothing (/proc is not mounted)" : failures);
}

}  // namespace polymorph
