// Modules: shared objects of this program that link a large or optional library each, and are
// opened on first use.
#pragma once

#include "base/result.h"

namespace polymorph {

/// Opens the module `file` ("polymorph_oiio.so") from the executable's folder, else from
/// ../LIBDIR/polymorph. If the environment variable `variable` is set, it names the only file that
/// is tried. `is_current` tests whether an opened module belongs to this version of the program.
/// The module stays open. Errors: kResource; the message lists each path that was tried and why it
/// failed, one per line, or is " nothing ..." without any path. Callers put it after "tried:".
Result<void*> open_module(const char* file, const char* variable, bool (*is_current)(void* handle));

}  // namespace polymorph
