// JSON of a comparison report, shared by its page and its files.
#pragma once

#include <string>

#include "base/json.h"
#include "compare/comparison_report.h"

namespace polymorph {

/// Makes the JSON of a case without its pictures. Infinite metrics become null.
JsonValue case_json(const ReportCase& result);

/// Makes the page that shows `data` (title, facts, notes, cases with their pictures). The page
/// lists failures first, then warnings.
std::string make_page(const std::string& title, JsonValue data);

}  // namespace polymorph
