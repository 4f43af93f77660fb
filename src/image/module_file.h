// Modules: shared objects of this program that link a large or optional library each, and are
// opened on first use.
#pragma once

#include "base/result.h"

namespace polymorph {

/// Opens the module `file` ("polymorph_oiio.so") from the executable's folder, else from
/// ../LIBDIR/polymorph. The environment variable `variable` names another file, and then only that
/// is tried. `is_current` says whether an opened one belongs to this version of the program. The
/// module stays open. Errors: kResource, each path tried and the reason on a line of its own, or
/// " nothing" and why.
Result<void*> open_module(const char* file, const char* variable, bool (*is_current)(void* handle));

}  // namespace polymorph
