#include "image/module_file.h"

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// Lists the paths to try, in order; none if /proc is not mounted.
std::vector<fs::path> list_candidates(const char* file, const char* variable) {
  if (const char* chosen = std::getenv(variable); chosen && *chosen) return {chosen};
  std::error_code error;
  const fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
  if (error) return {};
  std::vector<fs::path> paths{folder / file};
  // CMAKE_INSTALL_LIBDIR is one of these, depending on prefix and distribution.
  for (const char* library_folder : {
         "lib",
#if defined(__x86_64__)
             "lib/x86_64-linux-gnu",
#elif defined(__aarch64__)
                                     "lib/aarch64-linux-gnu",
#endif
             "lib64"
       })
    paths.push_back(folder.parent_path() / library_folder / "polymorph" / file);
  return paths;
}

}  // namespace

Result<void*> open_module(const char* file, const char* variable,
                          bool (*is_current)(void* handle)) {
  std::string failures;
  for (const fs::path& path : list_candidates(file, variable)) {
    std::error_code error;
    if (!fs::exists(path, error)) {
      failures += fmt::format("\n  {}: does not exist", path.string());
      continue;
    }
    void* handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!handle) {
      const char* reason = dlerror();
      failures += fmt::format("\n  {}: {}", path.string(), reason ? reason : "unknown reason");
      continue;
    }
    if (is_current(handle)) return handle;
    dlclose(handle);
    failures += fmt::format("\n  {}: it belongs to another version of polymorph", path.string());
  }
  return Error{ErrorCode::kResource,
               failures.empty() ? " nothing (/proc is not mounted)" : failures};
}

}  // namespace polymorph
