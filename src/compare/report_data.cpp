#include "compare/report_data.h"

#include <algorithm>
#include <cmath>

#include "base/json.h"
#include "base/text.h"

namespace polymorph {
namespace {

/// Limits of at least this value limit nothing. The defaults of Tolerance are 1e30.
constexpr float kNoLimit = 1e29f;

std::optional<double> limit_or_none(float limit) {
  return limit < kNoLimit ? std::optional<double>(static_cast<double>(limit)) : std::nullopt;
}

/// Converts a number; NaN and infinity, which JSON cannot represent, become null.
JsonValue to_json(double value) { return std::isfinite(value) ? JsonValue(value) : JsonValue(); }

/// Finds the channel with most failing pixels; null if no channel differs.
const ChannelDifference* worst_channel(const Comparison& comparison) {
  const ChannelDifference* worst = nullptr;
  for (const ChannelDifference& channel : comparison.channels)
    if (channel.max > 0 && (!worst || channel.failing > worst->failing)) worst = &channel;
  return worst;
}

/// Converts text for XML 1.0, in attributes or elements: valid UTF-8 without control characters.
std::string xml(const std::string& text) {
  // Writing and reading JSON replaces bytes that are not UTF-8 by U+FFFD.
  std::string clean = parse_json("", format_json(text))->root.string;
  for (char& c : clean)
    if (static_cast<unsigned char>(c) < 0x20 && c != '\n') c = ' ';
  return escape_markup(clean);
}

std::string case_verdict(const ReportCase& result) {
  if (!result.verdict.empty()) return result.verdict;
  if (result.comparison) return verdict_name(result.comparison->verdict);
  return result.error ? "error" : "missing";
}

std::string to_text(double value) {
  return std::isfinite(value) ? fmt::format("{:.6g}", value) : "inf";
}

std::string junit_case(const ReportCase& result, const std::string& suite) {
  std::string text = fmt::format("    <testcase classname=\"{}\" name=\"{}\" time=\"{:.3f}\">\n",
                                 xml(suite), xml(result.name), result.seconds);
  const std::vector<CaseMetric> metrics = case_metrics(result);
  if (!metrics.empty()) {
    text += "      <properties>\n";
    for (const CaseMetric& metric : metrics)
      text += fmt::format("        <property name=\"{}\" value=\"{}\"/>\n", metric.name,
                          to_text(metric.value));
    text += "      </properties>\n";
  }
  if (!result.passed()) {
    std::string details = result.message + "\n";
    if (!result.cause.empty()) details += "seen: " + result.cause + "\n";
    for (const CaseMetric& metric : metrics)
      if (metric.limit)
        details += fmt::format("{}{}: {} (limit {})\n", metric.over() ? "OVER " : "", metric.label,
                               to_text(metric.value), to_text(*metric.limit));
    if (!result.accept.empty()) details += "to accept: " + result.accept + "\n";
    const char* const element = result.error ? "error" : "failure";
    text += fmt::format("      <{0} message=\"{1}\">{2}</{0}>\n", element, xml(result.message),
                        xml(details));
  } else if (result.warned()) {
    text += fmt::format(
        "      <system-out>warning: {} pixels differ by more than {}</system-out>\n",
        result.comparison->warning_pixels, to_text(static_cast<double>(result.tolerance.warn)));
  }
  return text + "    </testcase>\n";
}

}  // namespace

std::vector<CaseMetric> case_metrics(const ReportCase& result) {
  std::vector<CaseMetric> metrics;
  if (!result.comparison || result.comparison->channels.empty()) return metrics;
  const Comparison& c = *result.comparison;
  const Tolerance& limits = result.tolerance;
  const double pixels = std::max(1.0, static_cast<double>(c.pixels));
  const auto add = [&](const char* name, const char* label, double value,
                       std::optional<double> limit) {
    metrics.push_back({name, label, value, limit});
  };
  add("fail_percent", "pixels over their limits, %",
      100 * static_cast<double>(c.failing_pixels) / pixels,
      static_cast<double>(limits.fail_percent));
  if (limits.hard_fail < kNoLimit)
    add("hard_failing_pixels", "pixels beyond the hard limit",
        static_cast<double>(c.hard_failing_pixels), 0);
  add("not_finite_pixels", "NaN or infinite pixels", static_cast<double>(c.not_finite_pixels), 0);
  add("negative_alpha_pixels", "pixels of negative alpha",
      static_cast<double>(c.negative_alpha_pixels), 0);
  if (result.masked_percent)
    add("masked_percent", "masked pixels, %", *result.masked_percent, result.max_masked_percent);
  if (c.flip) {
    add("flip_mean", "FLIP, mean", c.flip->mean, limit_or_none(limits.flip_mean));
    add("flip_p99", "FLIP, 99 % below", c.flip->p99, limit_or_none(limits.flip_p99));
    add("flip_max", "FLIP, max", c.flip->max, std::nullopt);
    add("psnr", "PSNR, dB", c.psnr, std::nullopt);
    if (result.flicker) add("flicker", "flicker to the next frame", *result.flicker, std::nullopt);
    if (result.reference_flicker)
      add("reference_flicker", "the reference's", *result.reference_flicker, std::nullopt);
  }
  return metrics;
}

JsonValue case_json(const ReportCase& result) {
  JsonValue json{{"group", result.group},
                 {"name", result.name},
                 {"actual", result.actual.string()},
                 {"reference", result.reference.string()},
                 {"passed", result.passed()},
                 {"warned", result.warned()},
                 {"verdict", case_verdict(result)},
                 {"reason", result.comparison ? result.comparison->reason
                            : result.passed() ? result.detail
                                              : result.message},
                 {"message", result.message},
                 {"cause", result.cause},
                 {"why", result.tolerance.why},
                 {"accept", result.accept}};
  if (result.seconds > 0) json["seconds"] = result.seconds;
  if (result.flicker) json["flicker"] = *result.flicker;
  if (result.reference_flicker) json["reference_flicker"] = *result.reference_flicker;
  if (!result.pixels_sha256.empty()) json["pixels_sha256"] = result.pixels_sha256;
  if (!result.file_sha256.empty()) json["file_sha256"] = result.file_sha256;
  if (result.surface) {
    json["frame"] = result.surface->frame;
    json["surface"] = {{"vertices", result.surface->vertices},
                       {"triangles", result.surface->triangles},
                       {"digest", result.surface->digest}};
  }
  json["figures"] = JsonValue::array();
  for (const CaseMetric& metric : case_metrics(result)) {
    JsonValue entry{
        {"name", metric.name}, {"label", metric.label}, {"value", to_json(metric.value)}};
    if (metric.limit) entry["limit"] = *metric.limit;
    entry["over"] = metric.over();
    json["figures"].push_back(std::move(entry));
  }
  if (!result.comparison) return json;
  const Comparison& c = *result.comparison;
  json["pixels"] = c.pixels;
  json["failing_pixels"] = c.failing_pixels;
  json["hard_failing_pixels"] = c.hard_failing_pixels;
  json["not_finite_pixels"] = c.not_finite_pixels;
  json["warning_pixels"] = c.warning_pixels;
  if (std::isfinite(c.psnr)) json["psnr"] = c.psnr;
  if (c.flip)
    json["flip"] = {{"mean", c.flip->mean},
                    {"median", c.flip->median},
                    {"p99", c.flip->p99},
                    {"max", c.flip->max}};
  json["channels"] = JsonValue::array();
  for (const ChannelDifference& d : c.channels)
    json["channels"].push_back({{"channel", d.channel},
                                {"max", d.max},
                                {"mean", d.mean},
                                {"rms", d.rms},
                                {"failing", d.failing},
                                {"at", JsonValue::array({d.max_x, d.max_y})}});
  if (c.channels.empty()) return json;
  if (const ChannelDifference* worst = worst_channel(c))
    json["worst"] = JsonValue::array({worst->max_x, worst->max_y});
  json["histogram"] = {{"at_limit", LimitHistogram::kAtLimit}, {"pixels", c.histogram.pixels}};
  return json;
}

JsonValue report_json(const Report& report, const std::vector<std::string>& files) {
  JsonValue json{{"title", report.title}};
  if (!files.empty()) json["polymorph_report"] = files;
  json["facts"] = JsonValue::object();
  for (const auto& [name, value] : report.facts) json["facts"][name] = value;
  if (!report.suites.empty()) json["suites"] = JsonValue::object();
  for (const auto& [name, hash] : report.suites) json["suites"][name] = hash;
  json["passed"] = report.cases.size() - report.failed();
  json["failed"] = report.failed();
  json["errors"] = report.errors();
  json["notes"] = report.notes;
  json["cases"] = JsonValue::array();
  for (const ReportCase& result : report.cases) json["cases"].push_back(case_json(result));
  return json;
}

std::string report_junit(const Report& report) {
  std::vector<std::string> groups;
  for (const ReportCase& result : report.cases)
    if (std::find(groups.begin(), groups.end(), result.group) == groups.end())
      groups.push_back(result.group);
  std::string text = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"{}\" tests=\"{}\" "
      "failures=\"{}\" errors=\"{}\">\n",
      xml(report.title), report.cases.size(), report.failed() - report.errors(), report.errors());
  for (const std::string& group : groups) {
    std::string cases;
    std::size_t count = 0, failed = 0, errors = 0;
    double seconds = 0;
    const std::string name = group.empty() ? "compare" : group;
    for (const ReportCase& result : report.cases) {
      if (result.group != group) continue;
      ++count;
      failed += !result.passed() && !result.error;
      errors += result.error;
      seconds += result.seconds;
      cases += junit_case(result, name);
    }
    text += fmt::format(
        "  <testsuite name=\"{}\" tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"0\" "
        "time=\"{:.3f}\">\n{}  </testsuite>\n",
        xml(name), count, failed, errors, seconds, cases);
  }
  return text + "</testsuites>\n";
}

}  // namespace polymorph
