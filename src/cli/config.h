// --config FILE: defaults of options, in TOML. Keys before the first section are for every command
// that has such an option, those under [COMMAND] for that one:
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
#include "cli/options.h"

namespace polymorph {

/// Sets the options of the chosen subcommand from the file, except those that the command line or
/// the environment has set. Checks the whole file, including what is for other commands. Errors
/// (kUsage): no such file, an unknown section or key, a value that the option does not take.
Status apply_config(const std::string& file, CLI::App& program);

/// Sets again the options of the chosen subcommand that variables can set: a variable sets those of
/// all other subcommands, too, and all of them share their values.
void prefer_command_line(const CLI::App& program);

}  // namespace polymorph
