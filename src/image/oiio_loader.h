// Loader of the OpenImageIO module: opens polymorph_oiio.so on first use and keeps it open.
#pragma once

#include "base/result.h"
#include "image/oiio_module.h"

namespace polymorph {

struct OiioModule {
  PmOiioDecodeFunction* decode = nullptr;
  PmOiioFreeFunction* release = nullptr;
};

/// Loads the module from the executable's folder, else from ../LIBDIR/polymorph. The environment
/// variable POLYMORPH_OIIO_MODULE names another file, and then only that is tried. Safe from
/// several threads. Errors: kResource, naming each path tried and the reason.
Result<OiioModule> load_oiio_module();

}  // namespace polymorph
