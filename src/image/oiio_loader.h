// Loader of the OpenImageIO module: opens polymorph_oiio.so on first use and keeps it open.
#pragma once

#include "base/result.h"
#include "image/oiio_module.h"

namespace polymorph {

struct OiioModule {
  PmOiioDecodeFunction* decode = nullptr;
  PmOiioFreeFunction* release = nullptr;
};

/// The module, looked for beside the executable, then in ../LIBDIR/polymorph from there. The
/// environment variable POLYMORPH_OIIO_MODULE names another file, and then only that one is tried.
/// Safe from several threads. Errors: kResource, naming each path tried and why it did not do.
Result<OiioModule> load_oiio_module();

}  // namespace polymorph
