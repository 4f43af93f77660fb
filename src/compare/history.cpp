#include "compare/history.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "base/file.h"
#include "base/program_identity.h"
#include "base/text.h"

namespace polymorph {
namespace {

constexpr const char* kHeader = "commit,metric,mean,worst,share";
constexpr std::size_t kRises = 4;  // runs, each above the one before it

std::optional<double> number_of(const std::string& text) {
  if (text == "inf") return std::numeric_limits<double>::infinity();
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !(value >= 0)) return std::nullopt;
  return value;
}

std::string text_of(double value) {
  return std::isfinite(value) ? fmt::format("{:.9g}", value) : "inf";
}

}  // namespace

Result<std::vector<HistoryRow>> read_history(const std::filesystem::path& csv) {
  std::vector<HistoryRow> rows;
  std::error_code ignored;
  if (!std::filesystem::exists(csv, ignored)) return rows;
  PM_TRY(const std::string text, read_file(csv, 64 << 20));
  std::vector<std::string> lines = split(text, '\n');
  while (!lines.empty() && lines.back().empty()) lines.pop_back();
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].ends_with('\r')) lines[i].pop_back();
    if (i == 0 && lines[i] == kHeader) continue;
    const std::vector<std::string> fields = split(lines[i], ',');
    const bool whole = fields.size() == 5 && i > 0;
    const auto mean = whole ? number_of(fields[2]) : std::nullopt;
    const auto worst = whole ? number_of(fields[3]) : std::nullopt;
    const auto share = whole ? number_of(fields[4]) : std::nullopt;
    if (!mean || !worst || (!share && !fields[4].empty()))
      return make_error(ErrorCode::kInput, "{}:{}: '{}' is not {}", csv.string(), i + 1, lines[i],
                        kHeader);
    rows.push_back({fields[0], fields[1], *mean, *worst, share});
  }
  return rows;
}

std::string history_text(const std::vector<HistoryRow>& rows) {
  std::string text = std::string(kHeader) + "\n";
  for (const HistoryRow& row : rows)
    text += fmt::format("{},{},{},{},{}\n", row.commit, row.metric, text_of(row.mean),
                        text_of(row.worst), row.share ? text_of(*row.share) : "");
  return text;
}

std::vector<HistoryRow> history_rows(const std::vector<ReportCase>& cases, const std::string& group,
                                     const std::string& commit) {
  std::vector<HistoryRow> rows;
  for (const char* metric : {"fail_percent", "flip_mean", "flip_p99"}) {
    HistoryRow row{commit, metric, 0, 0, std::nullopt};
    std::optional<double> limit;
    int count = 0;
    for (const ReportCase& one : cases) {
      if (one.group != group) continue;
      for (const CaseMetric& figure : metrics_of(one)) {
        if (figure.name != metric || !std::isfinite(figure.value)) continue;
        row.mean += figure.value;
        row.worst = std::max(row.worst, figure.value);
        limit = figure.limit;
        ++count;
      }
    }
    if (count == 0) continue;
    row.mean /= count;
    if (limit)
      row.share = *limit > 0      ? row.worst / *limit
                  : row.worst > 0 ? std::numeric_limits<double>::infinity()
                                  : 0;
    rows.push_back(std::move(row));
  }
  return rows;
}

std::string tested_commit() {
  for (const char* name : {"GITHUB_SHA", "CI_COMMIT_SHA"})
    if (const char* const value = std::getenv(name); value && *value) {
      std::string commit(value);
      std::replace_if(
          commit.begin(), commit.end(),
          [](unsigned char c) { return c == ',' || c < 0x20 || c >= 0x7f; }, '_');
      return commit.substr(0, 40);
    }
  const std::string identity(program_identity());
  return identity.substr(0, identity.find(' '));
}

std::vector<std::string> rising_metrics(const std::vector<HistoryRow>& rows) {
  std::vector<std::string> metrics, rising;
  for (const HistoryRow& row : rows)
    if (std::find(metrics.begin(), metrics.end(), row.metric) == metrics.end())
      metrics.push_back(row.metric);
  for (const std::string& metric : metrics) {
    std::vector<const HistoryRow*> of;
    for (const HistoryRow& row : rows)
      if (row.metric == metric) of.push_back(&row);
    if (of.back()->share && *of.back()->share > 1) return {};  // the run failed: that is said
    if (of.size() <= kRises) continue;
    bool all = true;
    for (std::size_t i = of.size() - kRises; i < of.size(); ++i)
      all = all && of[i]->mean > of[i - 1]->mean;
    if (all) rising.push_back(metric);
  }
  return rising;
}

}  // namespace polymorph
