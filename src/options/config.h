// Defaults of options in a TOML file (--config FILE). Keys before the first section apply to every
// command that has such an option, keys of a section [COMMAND] to that command:
//
//   threads = 2
//   [render]
//   png = true
//   set = ["image.samples=64"]
//
// The command line and POLYMORPH_ variables override the file.
#pragma once

#include <string>

#include "base/result.h"
#include "options/options.h"

namespace polymorph {

/// Sets the options of the chosen subcommand from the file, except those that the command line or
/// the environment has set. Checks the names of all sections and keys, also those of other
/// commands. Errors (kUsage): no such file, an unknown section or key, a value that the option does
/// not take.
Status apply_config(const std::string& file, CLI::App& program);

/// Makes the command line override the environment. All subcommands store a common option in one
/// C++ variable. CLI11 applies the environment also to the subcommands that were not chosen, which
/// overwrites values from the command line. So this function stores the values of the chosen
/// subcommand's options again, if they have an environment variable.
void prefer_command_line(const CLI::App& program);

}  // namespace polymorph
