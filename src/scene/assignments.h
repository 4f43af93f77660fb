// Completions of the command-line option --set: KEY=VALUE.
#pragma once

#include <string>
#include <vector>

namespace polymorph {

/// Lists "KEY=VALUE" for each value of an enumerated setting, and "KEY=" for other settings, in the
/// order of the schema. Keys inside the lists actors, intermediate and blend are left out.
std::vector<std::string> list_assignments();

}  // namespace polymorph
