// Receipt of a film: the frames of a run and what they were made from, as an in-toto statement.
#pragma once

#include <string>

#include "base/result.h"
#include "film/run_report.h"

namespace polymorph {

/// Makes an in-toto Statement v1 with a SLSA Provenance v1 predicate (docs/provenance.md) for the
/// files of all frames that were rendered or skipped; the files are read for their digests. The
/// text does not depend on time or machine. Errors: kOutput if a frame's file cannot be read.
Result<std::string> make_receipt(const RunReport& report);

/// Tests whether a text begins as the receipts of make_receipt() do.
bool is_receipt(const std::string& text);

}  // namespace polymorph
