#include "bench/bench.h"

#include "bench/bench_morph.h"
#include "cli/command_line.h"
#include "cli/report_options.h"
#include "device/device.h"
#include "kernels/field_kinds.h"

namespace polymorph {
namespace {

struct BenchOptions {
  BenchSettings settings;
  BenchMorphSettings morph;
  std::string truth;  ///< file of pairs with true points, or its folder; for `bench morph`
  std::vector<std::string> sets, limits;
  JsonOutput json;
};

/// Runs `bench morph`. Returns the exit code: 0 if all limits hold.
Result<int> run_bench_morph(const CommandLine& line, const BenchOptions& options, Engine& engine) {
  BenchMorphSettings settings = options.morph;
  settings.truth = options.truth;
  settings.cache = cache_folder(line.common);
  settings.memory = {line.common.max_memory};
  PM_TRY(settings.overrides, parse_overrides(options.sets));
  PM_TRY(const std::vector<Limit> limits, parse_limits(options.limits));
  const bool prints_table = !options.json.enabled;
  auto report = bench_morph(
      settings, engine,
      [&](const std::string& text) {
        if (prints_table) print_data("{}", text);
      },
      [] { return !stop_requested(); });
  if (!report && stop_requested()) return make_error(stop_code(), "stopped, nothing written");
  if (!report) return std::move(report).error();
  if (!prints_table) PM_TRY_STATUS(write_json(options.json, report->json));
  return check_limits(report->morphs, limits);
}

Result<int> run_bench(const CommandLine& line, const BenchOptions& options) {
  const bool is_morph = options.settings.what == "morph";
  if (is_morph && options.truth.empty())
    return make_error(ErrorCode::kUsage,
                      "bench morph: needs a file of pairs with true points, or its folder");
  if (!is_morph && !options.truth.empty())
    return make_error(ErrorCode::kUsage, "bench {}: {} is one argument too many",
                      options.settings.what, options.truth);
  std::string device;
  PM_TRY(const auto engine, make_engine(line.common.device, device, line.common.max_memory));
  if (is_morph) return run_bench_morph(line, options, *engine);
  BenchSettings settings = options.settings;
  settings.max_memory = line.common.max_memory;
  const bool prints_table = !options.json.enabled;
  PM_TRY(const JsonValue report,
         run_benchmarks(settings, device, *engine, [&](const std::string& text) {
           if (prints_table) print_data("{}", text);
         }));
  if (!prints_table) PM_TRY_STATUS(write_json(options.json, report));
  return 0;
}

}  // namespace

void add_bench(CommandLine& line) {
  auto options = std::make_shared<BenchOptions>();
  Command command =
      add_command(line, "bench",
                  "Measure this machine on a standard case, or morphs of pairs with true points.",
                  "  polymorph bench\n  polymorph bench surface --grid 256 "
                  "--device cuda\n  polymorph bench render --spp 64 --json\n"
                  "  polymorph bench morph truth.json\n"
                  "  polymorph bench morph truth.json --meshes \"theirs/{pair}.####.ply\"",
                  "  0 measured   1 a limit does not hold   2 usage   3 bad file, model or meshes\n"
                  "  5 device or memory");
  command
      .add_option("what", options->settings.what, "WHAT",
                  "surface, report (its Table 6.7 and Graph 6.1), render (which needs a surface "
                  "first), all "
                  "of these, or morph: pairs of models with true points")
      .choices({"surface", "report", "render", "all", "morph"});
  command.add_option("truth", options->truth, "TRUTH",
                     "morph: a file of pairs with true points, or a folder with a truth.json");
  command.add_option("--torus", options->settings.balls, "N", "balls on the torus (1032)")
      .range(1, 1000000);
  command.add_option("--balls", options->settings.ball_file, "FILE",
                     "balls from a JSON file instead of the torus");
  command.add_option("--grid", options->settings.grid, "N", "grid points along an axis (128)")
      .range(8, 4096);
  std::vector<std::string> fields;
  for (const FieldKind kind : kFieldKinds) fields.emplace_back(field_name(kind));
  command
      .add_option(
          "--field", options->settings.field, "FIELD",
          fmt::format("field function of the balls: {} (gaussian)", fmt::join(fields, ", ")))
      .choices(fields);
  command.add_option("--spp", options->settings.samples, "N", "samples per pixel (16)")
      .range(1, 65536);
  command.add_option("--repeats", options->settings.repeats, "N", "runs after the first (7)")
      .range(1, 1000);
  command.add_option("--meshes", options->morph.meshes, "MESHES",
                     "morph: another program's meshes, {pair} standing for FROM-TO");
  command
      .add_option("-c,--count", options->morph.frames, "N",
                  "morph: frames of each morph, ends included (9)")
      .range(2, 10000);
  command
      .add_option("--fail-on", options->limits, "LIMIT",
                  "morph: a limit that must hold for every pair, as \"map_error<=0.09\"")
      .one_value_each();
  add_overrides(command, options->sets);
  add_json(command, options->json);
  set_action(line, command, [&line, options] { return run_bench(line, *options); });
}

}  // namespace polymorph
