// The program's own data: models, effects, scenes and the schema. share/polymorph of an
// installation; in a build folder a link of that name to scenes/.
#pragma once

#include <filesystem>

#include "base/result.h"

namespace polymorph {

/// The absolute folder that holds models/ and effects/: POLYMORPH_DATA_DIR where that is set, else
/// share/polymorph beside the program or beside the folder that it lies in. Errors (kResource):
/// there is none; the message lists what was tried.
Result<std::filesystem::path> find_data_folder();

}  // namespace polymorph
