// Folder of the program's own data: models, effects, scenes and the schema. An installation has it
// at share/polymorph; in a build folder, share/polymorph is a link to scenes/.
#pragma once

#include <filesystem>

#include "base/result.h"

namespace polymorph {

/// Finds the absolute path of this folder: POLYMORPH_DATA_DIR if set, else share/polymorph in the
/// program's folder or in its parent. A candidate must contain models/. Errors: kResource if none
/// does; the message lists the candidates.
Result<std::filesystem::path> find_data_folder();

}  // namespace polymorph
