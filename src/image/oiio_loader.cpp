#include "image/oiio_loader.h"

#include <dlfcn.h>

#include <mutex>
#include <optional>

#include "image/module_file.h"

namespace polymorph {
namespace {

OiioModule find_oiio_functions(void* handle) {
  return {reinterpret_cast<PmOiioDecodeFunction*>(dlsym(handle, "polymorph_oiio_decode")),
          reinterpret_cast<PmOiioFreeFunction*>(dlsym(handle, "polymorph_oiio_free"))};
}

bool is_current_oiio(void* handle) {
  auto* version =
      reinterpret_cast<PmOiioInterfaceFunction*>(dlsym(handle, "polymorph_oiio_interface"));
  const OiioModule module = find_oiio_functions(handle);
  return version && module.decode && module.release && version() == PM_OIIO_INTERFACE;
}

}  // namespace

Result<OiioModule> load_oiio_module() {
  static std::mutex mutex;
  static std::optional<OiioModule> loaded;
  const std::lock_guard lock(mutex);
  if (loaded) return *loaded;
  const auto handle = open_module("polymorph_oiio.so", "POLYMORPH_OIIO_MODULE", is_current_oiio);
  if (!handle)
    return make_error(
        ErrorCode::kResource,
        "cannot open the image reader polymorph_oiio.so - install OpenImageIO (on Debian "
        "libopenimageio2.4), or convert the picture to PNG; POLYMORPH_OIIO_MODULE names a module "
        "that lies elsewhere; tried:{}",
        handle.error().message);
  loaded = find_oiio_functions(*handle);
  return *loaded;
}

}  // namespace polymorph
