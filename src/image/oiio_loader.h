// Loader of the OpenImageIO module: opens polymorph_oiio.so on first use and keeps it open.
#pragma once

#include "base/result.h"
#include "image/oiio_module.h"

namespace polymorph {

struct OiioModule {
  PmOiioDecodeFunction* decode = nullptr;
  PmOiioFreeFunction* release = nullptr;
};

/// Loads the module from the executable's folder, else from ../LIBDIR/polymorph. If the environment
/// variable POLYMORPH_OIIO_MODULE is set, it names the only file that is tried. Several threads may
/// call it at once. Errors: kResource; the message names each path tried and the reason.
Result<OiioModule> load_oiio_module();

}  // namespace polymorph
