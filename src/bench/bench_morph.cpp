#include "bench/bench_morph.h"

#include <fmt/format.h>

#include <optional>

#include "analyze/true_points.h"
#include "inspect/analyze_sequence.h"
#include "sequence/prepare/prepare.h"

namespace polymorph {
namespace {

/// A column of the table, which shows one metric.
struct Column {
  const char* metric;  ///< name in an Analysis (docs/method.md, Quality)
  const char* title;
  int width, decimals;
  bool weighted_by_points;  ///< the mean weights pairs by their numbers of points
};
constexpr Column kColumns[] = {
    {"points", "points", 6, 0, false},        {"plan_within_5", "plan .05", 8, 2, true},
    {"plan_within_10", ".10", 4, 2, true},    {"plan_error", "mean", 5, 3, true},
    {"map_within_5", "map .05", 7, 2, true},  {"map_within_10", ".10", 4, 2, true},
    {"map_error", "mean", 5, 3, true},        {"map_geodesic", "geodesic", 8, 3, true},
    {"true_facing", "turn err", 8, 0, false}, {"facing", "by plan", 7, 0, false},
    {"registration", "missed", 6, 3, false},  {"hull_dip", "hull", 5, 2, false},
    {"curvature", "curv.", 5, 2, false},      {"least_curvature", "least", 5, 2, false},
    {"area_dip", "area", 5, 3, false},        {"parts", "parts", 5, 1, false},
    {"topology", "topol.", 6, 1, false},      {"floating", "float", 5, 3, false},
    {"sinking", "sink", 5, 3, false},         {"distortion", "distort.", 8, 2, false},
};

using Row = std::vector<std::optional<double>>;  ///< one value per column

Row make_row(const Analysis& morph) {
  Row row;
  for (const Column& column : kColumns) row.push_back(morph.find(column.metric)->value);
  return row;
}

/// Returns the means of the columns, empty where no row has a value. Instead of a mean, the first
/// column (the number of points) gets the sum.
Row make_means(const std::vector<Row>& rows) {
  Row means;
  for (std::size_t c = 0; c < std::size(kColumns); ++c) {
    double sum = 0, weight_sum = 0;
    for (const Row& row : rows) {
      const double weight = kColumns[c].weighted_by_points ? row[0].value_or(0) : 1;
      if (!row[c]) continue;
      sum += weight * *row[c];
      weight_sum += weight;
    }
    if (c == 0)
      means.emplace_back(sum);
    else
      means.push_back(weight_sum > 0 ? std::optional(sum / weight_sum) : std::nullopt);
  }
  return means;
}

std::string format_row(const std::string& name, const Row& row) {
  std::string text = fmt::format("{:<24}", name);
  for (std::size_t c = 0; c < row.size(); ++c) {
    const Column& column = kColumns[c];
    text += row[c] ? fmt::format("  {:>{}.{}f}", *row[c], column.width, column.decimals)
                   : fmt::format("  {:>{}}", "-", column.width);
  }
  return text + "\n";
}

std::string format_heading() {
  std::string text = fmt::format("{:<24}", "pair");
  for (const Column& column : kColumns) text += fmt::format("  {:>{}}", column.title, column.width);
  return text + "\n";
}

/// Makes the scene that morphs a pair, with default settings except for the overrides.
Result<Scene> make_scene(const Truth& truth, const TrueModel& from, const TrueModel& to,
                         std::span<const Override> overrides) {
  const auto object = [](const TrueModel& entry) {
    const char* up = entry.up == UpAxis::kX ? "x" : entry.up == UpAxis::kZ ? "z" : "y";
    return JsonValue{{"model", std::filesystem::absolute(entry.model).string()},
                     {"name", entry.name},
                     {"up", up}};
  };
  const JsonValue scene{{"source", object(from)}, {"target", object(to)}};
  return load_scene_text(truth.file, format_json(scene), overrides);
}

/// Measures this program's morph of pair `pair` of `truth` or, with `settings.meshes`, that of
/// another program.
Result<Analysis> measure_pair(const BenchMorphSettings& settings, const Truth& truth,
                              std::size_t pair, Engine& engine,
                              const std::function<bool()>& keep_going) {
  const TrueModel &from = truth.models[truth.pairs[pair].first],
                  &to = truth.models[truth.pairs[pair].second];
  const AnalyzeProgress progress = [&](int, int) { return keep_going(); };
  std::vector<Analysis> morphs;
  if (settings.meshes.empty()) {
    PM_TRY(const Scene scene, make_scene(truth, from, to, settings.overrides));
    PM_TRY(const PreparedScene prepared,
           prepare_scene(scene, engine, {settings.cache, settings.memory}));
    PM_TRY(morphs, analyze_scene(prepared, engine, settings.frames, progress, &truth));
  } else {
    std::string pattern = settings.meshes;
    const std::string placeholder = "{pair}", name = from.name + "-" + to.name;
    for (auto at = pattern.find(placeholder); at != std::string::npos;
         at = pattern.find(placeholder, at + name.size()))
      pattern.replace(at, placeholder.size(), name);
    PM_TRY(const FramePattern frames, parse_pattern(pattern));
    if (!frames.has_number())
      return make_error(ErrorCode::kUsage,
                        "--meshes {}: has no place for the frame number, as in "
                        "\"theirs/{{pair}}.####.ply\"",
                        settings.meshes);
    PM_TRY(morphs, analyze_meshes({frames, /*source=*/{}, /*target=*/{}, {&from, &to}}, progress));
  }
  morphs.front().from = from.name;
  morphs.front().to = to.name;
  return std::move(morphs.front());
}

}  // namespace

Result<BenchMorphReport> bench_morph(const BenchMorphSettings& settings, Engine& engine,
                                     const std::function<void(const std::string&)>& print,
                                     const std::function<bool()>& keep_going) {
  PM_TRY(const Truth truth, load_truth(settings.truth));
  if (truth.pairs.empty())
    return make_error(ErrorCode::kInput,
                      "{}: names no pairs - write \"pairs\": [[\"FROM\", \"TO\"]]",
                      truth.file.string());
  for (const auto& [from, to] : truth.pairs)
    if (pair_points(truth.models[from], truth.models[to]).from.empty())
      return make_error(ErrorCode::kInput, "{}: {} and {} have no point of the same name",
                        truth.file.string(), truth.models[from].name, truth.models[to].name);
  BenchMorphReport report;
  std::vector<Row> rows;
  print(format_heading());
  for (std::size_t pair = 0; pair < truth.pairs.size(); ++pair) {
    PM_TRY(Analysis morph, measure_pair(settings, truth, pair, engine, keep_going));
    rows.push_back(make_row(morph));
    print(format_row(morph.from + "-" + morph.to, rows.back()));
    report.morphs.push_back(std::move(morph));
  }
  const Row means = make_means(rows);
  print(format_row(fmt::format("all ({})", rows.size()), means));
  report.json = analysis_json(report.morphs);
  JsonValue all = JsonValue::object();
  for (std::size_t c = 0; c < means.size(); ++c)
    all[kColumns[c].metric] = means[c] ? JsonValue(*means[c]) : JsonValue();
  report.json["all"] = all;
  return report;
}

}  // namespace polymorph
