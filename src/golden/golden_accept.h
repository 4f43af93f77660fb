// Acceptance of golden frames: failed frames of a test run become the new golden frames ("goldens")
// without being rendered again.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace polymorph {

struct AcceptSettings {
  std::filesystem::path root;       ///< folder of the suites
  std::vector<std::string> suites;  ///< suites to accept frames of; empty: all of the report
  std::string frames;               ///< frames to accept, "4,9-15"; empty: all failed frames
  std::string reason;               ///< reason for the change, for CHANGES.md
  bool any_program = false;         ///< also accepts the report of another build
};

/// Makes failed frames of a report goldens. `report` is the folder, .zip or .tar that `golden test
/// --report` wrote, with the frames of --failures inside it or beside it in the same archive.
/// Checks that this build made the report, from the same scenes; that every frame's file is the one
/// that the test run wrote; and that all pixels are finite. Then writes the chosen frames,
/// surface.csv and CHANGES.md, all or nothing. Returns the written files. Errors: kUsage as for
/// update_golden(); kInput if a check fails; kOutput.
Result<std::vector<std::filesystem::path>> accept_report(const std::filesystem::path& report,
                                                         const AcceptSettings& settings);

}  // namespace polymorph
