// Files of a golden suite's folder: frames, surface.csv and CHANGES.md.
#pragma once

#include "base/file.h"
#include "compare/golden.h"
#include "image/image.h"

namespace polymorph {

/// A frame that becomes a golden.
struct NewGolden {
  SurfaceRecord surface;
  std::string bytes;  ///< content of the image file; empty: the image stays as it is
};

/// Checks that goldens may be written. `verb` is the subcommand of `golden` that the message names.
/// Errors: kUsage without a reason of one line, or if the environment variable CI is set and
/// neither "false" nor "0".
Status check_write_allowed(const std::string& verb, const std::string& reason);

/// Tests whether all pixels are finite.
bool all_finite(const Image& image);

/// Returns the files that must be written to make these frames goldens: the images, surface.csv
/// (which keeps the rows of the suite's other frames) and CHANGES.md. An entry with the reason is
/// appended to CHANGES.md, or replaces the last entry if that has the same reason. Returns no files
/// if nothing changes. The caller must write all of them or none (base/file.h, write_files).
/// Errors: kInput.
Result<std::vector<NewFile>> make_golden_files(const GoldenSuite& suite,
                                               const std::vector<NewGolden>& frames,
                                               const std::string& reason);

}  // namespace polymorph
