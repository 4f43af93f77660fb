#include "image/oiio_loader.h"

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace polymorph {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> candidates() {
  if (const char* chosen = std::getenv("POLYMORPH_OIIO_MODULE"); chosen && *chosen) return {chosen};
  std::error_code error;
  const fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
  if (error) return {};
  std::vector<fs::path> paths{folder / "polymorph_oiio.so"};
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
    paths.push_back(folder.parent_path() / library_folder / "polymorph" / "polymorph_oiio.so");
  return paths;
}

/// Opens the module at `path`.
Result<OiioModule> open_module(const fs::path& path) {
  void* handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!handle) {
    const char* reason = dlerror();
    return Error{ErrorCode::kResource, reason ? reason : "unknown reason"};
  }
  OiioModule module;
  auto* version =
      reinterpret_cast<PmOiioInterfaceFunction*>(dlsym(handle, "polymorph_oiio_interface"));
  module.decode = reinterpret_cast<PmOiioDecodeFunction*>(dlsym(handle, "polymorph_oiio_decode"));
  module.release = reinterpret_cast<PmOiioFreeFunction*>(dlsym(handle, "polymorph_oiio_free"));
  if (version && module.decode && module.release && version() == PM_OIIO_INTERFACE) return module;
  dlclose(handle);
  return Error{ErrorCode::kResource, "it belongs to another version of polymorph"};
}

}  // namespace

Result<OiioModule> load_oiio_module() {
  static std::mutex mutex;
  static std::optional<OiioModule> loaded;
  const std::lock_guard lock(mutex);
  if (loaded) return *loaded;
  std::string tried;
  for (const fs::path& path : candidates()) {
    std::error_code error;
    if (!fs::exists(path, error)) {
      tried += fmt::format("\n  {}: does not exist", path.string());
      continue;
    }
    Result<OiioModule> module = open_module(path);
    if (module) {
      loaded = *module;
      return *module;
    }
    tried += fmt::format("\n  {}: {}", path.string(), module.error().message);
  }
  return make_error(
      ErrorCode::kResource,
      "cannot open the image reader polymorph_oiio.so - install OpenImageIO (on Debian "
      "libopenimageio2.4), or convert the picture to PNG; POLYMORPH_OIIO_MODULE names a module "
      "that lies elsewhere; tried:{}",
      tried.empty() ? " nothing (/proc is not mounted)" : tried);
}

}  // namespace polymorph
