// Analysis reports: JSON, CSV and HTML files of an analysis, and comparison of its metrics with
// limits.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "analyze/analyze.h"
#include "base/json.h"
#include "base/result.h"

namespace polymorph {

/// Formats analyses as {"morphs": [{"from", "to", "metrics": {name: {value, goal, principle,
/// what}}, "frames": [...]}]}; values that cannot be measured are null.
JsonValue analysis_json(const std::vector<Analysis>& morphs);

/// Formats one line per frame: morph, time, u and every measure of the frame.
std::string analysis_csv(const std::vector<Analysis>& morphs);

/// Makes a page with the numbers and a curve of every measure. It needs no other files and follows
/// the browser's dark or light mode.
std::string analysis_html(const std::vector<Analysis>& morphs, const std::string& title);

/// A limit of a metric, as in "pop<=2": its name, <=, >=, <, > or =, and a number.
struct Limit {
  std::string metric, comparison;
  double bound = 0;
  std::string text;
};
/// Parses a limit. Errors (kUsage): a syntax error, or an unknown metric (the message names the
/// nearest one).
Result<Limit> parse_limit(const std::string& text);

/// Makes a line for each limit that does not hold in some morph, or whose metric cannot be
/// measured.
std::vector<std::string> broken_limits(const std::vector<Analysis>& morphs,
                                       const std::vector<Limit>& limits);

/// Tests whether `value` reaches the goal, as "<= 2". An empty goal is always reached.
bool reaches(double value, const std::string& goal);

/// Lists the names of all metrics, in the order of the report.
std::vector<std::string> metric_names();

}  // namespace polymorph
