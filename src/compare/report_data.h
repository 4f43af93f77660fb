// JSON of a comparison report, shared by its page and its files.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "compare/comparison_report.h"

namespace polymorph {

/// All but the pictures. Infinite figures are null.
nlohmann::ordered_json case_json(const ReportCase& result);

/// The page that shows `data` (title, facts, notes, cases with their pictures).
std::string make_page(const std::string& title, nlohmann::ordered_json data);

}  // namespace polymorph
