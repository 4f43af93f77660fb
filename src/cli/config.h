// --config FILE: defaults of options, in TOML. Keys before the first section are for every command
// that has such an option, those under [COMMAND] for that one:
//
//   threads = 2
//   [render]
//   png = true
//   set = ["image.samples=64"]
//
// What the command line or a POLYMORPH_ variable says wins.
#pragma once

#include <string>

#include "base/result.h"
#include "cli/options.h"

namespace polymorph {

/// Gives the options of the chosen subcommand that the command line and the environment have left
/// open the values of the file. The whole file is checked, also what is for other commands. Errors
/// (kUsage): no such file, an unknown section or key, a value that the option does not take.
Status apply_config(const std::string& file, CLI::App& program);

}  // namespace polymorph
