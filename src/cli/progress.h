// Progress display: a bar on a terminal, one line per frame elsewhere.
#pragma once

#include "cli/command_line.h"
#include "sequence/render_sequence.h"

namespace polymorph {

ProgressCallback make_progress(ProgressMode mode);

}  // namespace polymorph
