// Analysis reports: JSON, CSV and HTML files of an analysis, and comparison of its metrics with
// limits.
#pragma once

#include <string>
#include <vector>

#include "analyze/analyze.h"
#include "base/json.h"
#include "base/result.h"

namespace polymorph {

/// Formats analyses as {"morphs": [{"from", "to", "actor", "metrics": {name: {"value", "goal",
/// "principle", "what"}}, "frames": [{"time", "u", ...}]}]}. "actor" is missing if it has no name;
/// values that cannot be measured are null.
JsonValue analysis_json(const std::vector<Analysis>& morphs);

/// Formats a header line, then one line per frame: the number of its morph, from 1, its time, u and
/// every measure of the frame. A measure without a value is an empty cell.
std::string analysis_csv(const std::vector<Analysis>& morphs);

/// Makes a page with the metrics, curves of the measures over time, and the checks of every frame's
/// surface. Numbers of vertices and of defective edges and vertices have no curve. The page needs
/// no other files and follows the browser's dark or light mode.
std::string analysis_html(const std::vector<Analysis>& morphs, const std::string& title);

/// A limit of a metric: METRIC COMPARISON NUMBER, as in "pop<=2".
struct Limit {
  std::string metric, comparison;  ///< the comparison is "<=", ">=", "<", ">" or "="
  double bound = 0;
  std::string text;  ///< the limit as the user wrote it
};
/// Parses a limit; "==" means "=". Errors (kUsage): a syntax error, or an unknown metric (the
/// message names the nearest one).
Result<Limit> parse_limit(const std::string& text);

/// Returns a message for each morph and each limit that does not hold in it, or whose metric cannot
/// be measured there.
std::vector<std::string> broken_limits(const std::vector<Analysis>& morphs,
                                       const std::vector<Limit>& limits);

/// Tests whether `value` reaches a goal, which is a comparison, a space and a number ("<= 2"). An
/// empty goal is always reached.
bool reaches(double value, const std::string& goal);

}  // namespace polymorph
