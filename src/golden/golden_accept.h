// The frames of a red run become goldens, without being rendered again.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace polymorph {

struct AcceptSettings {
  std::filesystem::path root;       ///< folder of the suites
  std::vector<std::string> suites;  ///< only these; empty: all of the report
  std::string frames;               ///< only these, "4,9-15"; empty: all that failed
  std::string reason;               ///< goes to CHANGES.md
  bool any_program = false;         ///< also of a report that another build made
};

/// Takes the report that `golden test --report` left, with the frames that it kept (--failures
/// inside of it, or beside it in the same archive): a folder, .zip or .tar. Checks that the suites'
/// scenes are those of the report, and that this program is; that every frame is the file that the
/// run wrote, can be read and has no NaN. Then all chosen frames that failed become goldens, with
/// surface.csv and CHANGES.md: all or nothing. Returns what was written. Errors: kUsage as of
/// update_golden(), kInput for all else that does not fit, kOutput.
Result<std::vector<std::filesystem::path>> accept_report(const std::filesystem::path& report,
                                                         const AcceptSettings& settings);

}  // namespace polymorph
