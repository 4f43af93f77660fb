// Modules: shared objects of this program that link a large or optional library each, and are
// opened on first use.
#pragma once

#include "base/result.h"

namespace polymorph {

/// Opens the module `file` ("polymorph_oiio.so") from the executable's folder, else from
/// ../lib/polymorph, ../lib/ARCHITECTURE-linux-gnu/polymorph or ../lib64/polymorph. If the
/// environment variable `variable` is set, it names the only file that is tried. `is_current` tests
/// whether an opened module belongs to this version of the program. The module stays open. Errors:
/// kResource. Its message continues the caller's "tried:". For each path that was tried it has a
/// line with the path and why it failed; if the executable's folder is unknown, it is " nothing
/// (/proc is not mounted)".
Result<void*> open_module(const char* file, const char* variable, bool (*is_current)(void* handle));

}  // namespace polymorph
