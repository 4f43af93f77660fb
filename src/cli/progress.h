// How far a sequence is: a bar on a terminal, a line a frame elsewhere.
#pragma once

#include "cli/command_line.h"
#include "sequence/render_sequence.h"

namespace polymorph {

ProgressCallback make_progress(ProgressMode mode);

}  // namespace polymorph
