#include "analyze/analysis_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string_view>

#include "base/json.h"
#include "base/text.h"

namespace polymorph {
namespace {

JsonValue number_or_null(std::optional<double> value) {
  return value && std::isfinite(*value) ? JsonValue(*value) : JsonValue();
}

/// Tests whether "value comparison bound" is true, as in 1 <= 2.
bool holds(double value, const std::string& comparison, double bound) {
  if (comparison == "<=") return value <= bound;
  if (comparison == ">=") return value >= bound;
  if (comparison == "<") return value < bound;
  if (comparison == ">") return value > bound;
  return value == bound;
}

/// Draws one measure of all frames as a curve (SVG).
std::string draw_curve(const Analysis& morph, const MeasureColumn& column) {
  constexpr double kWidth = 360, kHeight = 120;  // units of the SVG's view box
  std::vector<std::pair<double, double>> points;
  double low = INFINITY, high = -INFINITY;
  for (const FrameMeasures& row : morph.frames) {
    const auto value = column.value(row);
    if (!value || !std::isfinite(*value)) continue;
    points.emplace_back(row.time, *value);
    low = std::min(low, *value);
    high = std::max(high, *value);
  }
  if (points.empty()) return {};
  // If all values are positive, the axis begins at 0, unless the values differ by less than 20 %. A
  // constant curve lies in the middle.
  if (low > 0 && low < 0.8 * high) low = 0;
  const double span = high > low ? high - low : 1, base = high > low ? low : low - 0.5;
  std::string path, dots;
  // Times 0 to 1 and values `low` to `high` fill the view box up to margins of 4 and 6 units.
  for (const auto& [x, y] : points) {
    const double px = 4 + x * (kWidth - 8), py = kHeight - 6 - (y - base) / span * (kHeight - 12);
    path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", px, py);
    dots += fmt::format(
        "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.2\"><title>t = {:.3f}: {:.6g}</title></circle>",
        px, py, x, y);
  }
  return fmt::format(
      "<figure><figcaption><b>{}</b> {}</figcaption><div class=\"plot\"><svg viewBox=\"0 0 {} {}\" "
      "role=\"img\" aria-label=\"{} over time\"><path d=\"{}\"/>{}</svg><span class=\"high\">{:.4g}"
      "</span><span class=\"low\">{:.4g}</span></div></figure>\n",
      column.name, escape_markup(column.definition), kWidth, kHeight, column.name, path, dots, high,
      low);
}

constexpr const char* kStyle = R"(<style>
:root{color-scheme:light dark;--back:#fafafa;--fore:#1c1c1e;--soft:#6b6b70;--line:#d8d8dc;--curve:#1f5fbf;--good:#1b7f3b;--bad:#b3261e}
@media(prefers-color-scheme:dark){:root{--back:#18181b;--fore:#ececf0;--soft:#9a9aa2;--line:#3a3a40;--curve:#7fb2ff;--good:#6fd08c;--bad:#ff8a80}}
body{background:var(--back);color:var(--fore);font:15px/1.45 system-ui,sans-serif;margin:2rem auto;max-width:1180px;padding:0 1rem}
h1{font-size:1.4rem}h2{font-size:1.15rem;margin-top:2rem}
table{border-collapse:collapse;width:100%}td,th{text-align:left;padding:.25rem .6rem;border-bottom:1px solid var(--line)}
td.n{font-variant-numeric:tabular-nums;text-align:right}td.good{color:var(--good)}td.bad{color:var(--bad);font-weight:600}
.soft,figcaption{color:var(--soft)}figcaption b{color:var(--fore)}
.plots{display:grid;grid-template-columns:repeat(auto-fill,minmax(340px,1fr));gap:1rem;margin-top:1rem}
figure{margin:0}.plot{position:relative;border:1px solid var(--line);border-radius:4px}
svg{display:block;width:100%}path{fill:none;stroke:var(--curve);stroke-width:1.6}circle{fill:var(--curve)}
.plot span{position:absolute;right:.4rem;font-size:.75rem;color:var(--soft)}.high{top:.1rem}.low{bottom:.1rem}
.wide{overflow-x:auto}
</style>
)";

std::string format_metric_rows(const Analysis& morph) {
  std::string text;
  for (const Metric& metric : morph.metrics) {
    const bool known = metric.value.has_value();
    const char* css_class = !known || metric.goal.empty()         ? ""
                            : reaches(*metric.value, metric.goal) ? " good"
                                                                  : " bad";
    text += fmt::format(
        "<tr><td>{}</td><td>{}</td><td class=\"n{}\">{}</td><td>{}</td><td "
        "class=\"soft\">{}</td></tr>\n",
        escape_markup(metric.principle), metric.name, css_class,
        known ? fmt::format("{:.4g}", *metric.value) : "-", escape_markup(metric.goal),
        escape_markup(metric.definition));
  }
  return text;
}

std::string format_frame_rows(const Analysis& morph) {
  std::string text;
  for (const FrameMeasures& row : morph.frames)
    text += fmt::format(
        "<tr><td class=\"n\">{:.3f}</td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td>"
        "<td class=\"n\">{}</td><td class=\"n\">{:.6g}</td><td class=\"n\">{:.6g}</td><td>{}</td>"
        "</tr>\n",
        row.time,
        row.surface.is_manifold() ? "closed, manifold, oriented" : "NOT a closed manifold",
        row.surface.euler, row.surface.components, row.surface.genus, row.surface.volume,
        row.surface.area, row.surface.digest);
  return text;
}

}  // namespace

JsonValue analysis_json(const std::vector<Analysis>& morphs) {
  JsonValue root;
  root["morphs"] = JsonValue::array();
  for (const Analysis& morph : morphs) {
    JsonValue entry{{"from", morph.from}, {"to", morph.to}};
    if (!morph.actor.empty()) entry["actor"] = morph.actor;
    for (const Metric& metric : morph.metrics)
      entry["metrics"][metric.name] = {{"value", number_or_null(metric.value)},
                                       {"goal", metric.goal},
                                       {"principle", metric.principle},
                                       {"what", metric.definition}};
    entry["frames"] = JsonValue::array();
    for (const FrameMeasures& row : morph.frames) {
      JsonValue frame{{"time", row.time},
                      {"u", row.u},
                      {"closed", row.surface.is_closed()},
                      {"manifold", row.surface.is_manifold()},
                      {"digest", row.surface.digest}};
      for (const MeasureColumn& column : measure_columns())
        frame[column.name] = number_or_null(column.value(row));
      entry["frames"].push_back(frame);
    }
    root["morphs"].push_back(entry);
  }
  return root;
}

std::string analysis_csv(const std::vector<Analysis>& morphs) {
  std::string text = "morph,time,u";
  for (const MeasureColumn& column : measure_columns()) text += fmt::format(",{}", column.name);
  text += ",closed,manifold,digest\n";
  auto out = std::back_inserter(text);
  for (std::size_t m = 0; m < morphs.size(); ++m)
    for (const FrameMeasures& row : morphs[m].frames) {
      fmt::format_to(out, "{},{:.9g},{:.9g}", m + 1, row.time, row.u);
      for (const MeasureColumn& column : measure_columns()) {
        const auto value = column.value(row);
        text += value && std::isfinite(*value) ? fmt::format(",{:.9g}", *value) : std::string(",");
      }
      fmt::format_to(out, ",{},{},{}\n", row.surface.is_closed() ? 1 : 0,
                     row.surface.is_manifold() ? 1 : 0, row.surface.digest);
    }
  return text;
}

std::string analysis_html(const std::vector<Analysis>& morphs, const std::string& title) {
  std::string text = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\">\n<title>{0}</title>\n{1}</head><body>\n<h1>{0}</h1>\n",
      escape_markup(title), kStyle);
  for (const Analysis& morph : morphs) {
    text += fmt::format("<h2>{}</h2>\n", escape_markup(morph_name(morph)));
    text +=
        "<table><tr><th>principle</th><th>metric</th><th>value</th><th>goal</th><th></th></tr>\n" +
        format_metric_rows(morph) + "</table>\n<div class=\"plots\">\n";
    for (const MeasureColumn& column : measure_columns())
      if (std::string_view(column.name) != "vertices" &&
          !std::string_view(column.name).ends_with("_edges") &&
          std::string_view(column.name) != "pinched_vertices")
        text += draw_curve(morph, column);
    text +=
        "</div>\n<h3>Certificates</h3>\n<div "
        "class=\"wide\"><table><tr><th>time</th><th>surface</th>"
        "<th>Euler</th><th>parts</th><th>genus</th><th>volume</th><th>area</th><th>digest</th>"
        "</tr>\n" +
        format_frame_rows(morph) + "</table></div>\n";
  }
  return text + "</body></html>\n";
}

bool reaches(double value, const std::string& goal) {
  const auto space = goal.find(' ');
  if (space == std::string::npos) return true;
  const auto bound = parse_number(goal.substr(space + 1));
  return bound && holds(value, goal.substr(0, space), *bound);
}

Result<Limit> parse_limit(const std::string& text) {
  const auto sign = text.find_first_of("<>=");
  Limit limit;
  limit.text = text;
  if (sign != std::string::npos) {
    const bool has_equals_sign = sign + 1 < text.size() && text[sign + 1] == '=';
    const auto trim = [](std::string word) {
      word.erase(0, word.find_first_not_of(' '));
      word.erase(word.find_last_not_of(' ') + 1);
      return word;
    };
    limit.metric = trim(text.substr(0, sign));
    limit.comparison = text.substr(sign, has_equals_sign ? 2 : 1);
    if (limit.comparison == "==") limit.comparison = "=";
    const auto bound = parse_number(trim(text.substr(sign + (has_equals_sign ? 2 : 1))));
    if (bound && !limit.metric.empty()) {
      limit.bound = *bound;
      const std::vector<std::string> names = metric_names();
      if (std::find(names.begin(), names.end(), limit.metric) != names.end()) return limit;
      return make_error(ErrorCode::kUsage,
                        "--fail-on {}: no metric is called \"{}\"{} - there are {}", text,
                        limit.metric, did_you_mean(limit.metric, names), join_quoted(names));
    }
  }
  return make_error(
      ErrorCode::kUsage,
      "--fail-on {}: write a metric, <=, >=, <, > or =, and a number, as in \"pop<=2\"", text);
}

std::vector<std::string> broken_limits(const std::vector<Analysis>& morphs,
                                       const std::vector<Limit>& limits) {
  std::vector<std::string> broken;
  for (const Analysis& morph : morphs)
    for (const Limit& limit : limits) {
      const Metric* metric = morph.find(limit.metric);
      if (!metric || !metric->value)
        broken.push_back(
            fmt::format("{}: {} cannot be measured here", morph_name(morph), limit.metric));
      else if (!holds(*metric->value, limit.comparison, limit.bound))
        broken.push_back(fmt::format("{}: {} is {:.6g}, not {} {:g}", morph_name(morph),
                                     limit.metric, *metric->value, limit.comparison, limit.bound));
    }
  return broken;
}

}  // namespace polymorph
