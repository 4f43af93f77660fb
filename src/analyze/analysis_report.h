// Analysis reports: JSON, CSV and HTML files of an analysis, and its comparison with limits.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "analyze/analyze.h"
#include "base/json.h"
#include "base/result.h"

namespace polymorph {

/// {"morphs": [{"from", "to", "metrics": {name: {value, goal, principle, what}}, "frames":
/// [...]}]}; what cannot be measured is null.
JsonValue analysis_json(const std::vector<Analysis>& morphs);

/// One line per frame: morph, time, u and every measure of the frame.
std::string analysis_csv(const std::vector<Analysis>& morphs);

/// One page with the numbers and a curve of every measure; needs nothing but itself, follows the
/// reader's choice of dark or light.
std::string analysis_html(const std::vector<Analysis>& morphs, const std::string& title);

/// "pop<=2": a metric's name, <=, >=, <, > or =, a number.
struct Limit {
  std::string metric, comparison;
  double bound = 0;
  std::string text;
};
/// Errors (kUsage): syntax, or no such metric (the nearest one is named).
Result<Limit> parse_limit(const std::string& text);

/// A line for each limit that does not hold, or whose metric cannot be measured, in some morph.
std::vector<std::string> broken_limits(const std::vector<Analysis>& morphs,
                                       const std::vector<Limit>& limits);

/// Tests whether `value` reaches the goal, as "<= 2". An empty goal is always reached.
bool reaches(double value, const std::string& goal);

/// Every metric's name, in order.
std::vector<std::string> metric_names();

}  // namespace polymorph
