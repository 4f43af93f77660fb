// Assignments that --set takes, for completions.
#pragma once

#include <string>
#include <vector>

namespace polymorph {

/// "KEY=VALUE" for each word that a setting may be, and "KEY=" for settings that are no words, in
/// the order of the schema. Keys of actors and of objects on the way have numbers and are left out.
std::vector<std::string> list_assignments();

}  // namespace polymorph
