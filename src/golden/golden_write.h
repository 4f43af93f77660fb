// Files of a golden suite's folder: frames, surface.csv and CHANGES.md.
#pragma once

#include "base/file.h"
#include "compare/golden.h"
#include "image/image.h"

namespace polymorph {

/// A frame that becomes a golden.
struct NewGolden {
  SurfaceRecord surface;
  std::string bytes;  ///< empty: the golden stays, only its record may change
};

/// Tests whether goldens may be written now. Errors: kUsage without a reason, or when CI is set in
/// the environment; the message names the command's `verb`.
Status may_write_goldens(const std::string& verb, const std::string& reason);

/// Tests whether all values are finite.
bool all_finite(const Image& image);

/// The files that make these frames goldens: the frames, surface.csv (with the rows that stay) and
/// CHANGES.md with the reason at its end; a reason that stands there last is not repeated. Empty
/// if nothing changes. Write them all or none (base/file.h, write_files). Errors: kInput.
Result<std::vector<NewFile>> golden_files(const GoldenSuite& suite,
                                          const std::vector<NewGolden>& frames,
                                          const std::string& reason);

}  // namespace polymorph
