// Receipt of a film: the frames of a run and what they were made from, as an in-toto statement.
#pragma once

#include <string>

#include "base/result.h"
#include "sequence/run/run_report.h"

namespace polymorph {

/// Makes an in-toto Statement v1 with a SLSA Provenance v1 predicate (docs/provenance.md) of the
/// files of all frames that are done or were kept; the files are read for their digests. The same
/// frames give the same text: nothing in it depends on the time or the machine. Errors: kOutput
/// where a frame's file cannot be read any more.
Result<std::string> make_receipt(const RunReport& report);

/// Tests whether this text is a receipt.
bool is_receipt(const std::string& text);

}  // namespace polymorph
