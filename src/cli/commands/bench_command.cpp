#include "bench/bench.h"

#include "cli/command_line.h"
#include "kernels/field_kinds.h"
#include "sequence/run/device.h"

namespace polymorph {
namespace {

struct BenchOptions {
  BenchSettings settings;
  JsonOutput json;
};

Result<int> run_bench(const CommandLine& line, const BenchOptions& options) {
  std::string device;
  PM_TRY(const auto engine, make_engine(line.common.device, device, line.common.max_memory));
  const bool table = !options.json.enabled;
  PM_TRY(const JsonValue report,
         run_benchmarks(options.settings, device, *engine, [&](const std::string& text) {
           if (table) print_data("{}", text);
         }));
  if (!table) PM_TRY_STATUS(write_json(options.json, report));
  return 0;
}

}  // namespace

void add_bench(CommandLine& line) {
  auto options = std::make_shared<BenchOptions>();
  Command command = add_command(line, "bench", "Measure this machine on a standard case.",
                                "  polymorph bench\n  polymorph bench surface --grid 256 "
                                "--device cuda\n  polymorph bench render --spp 64 --json",
                                "  0 measured   2 usage   5 device or memory");
  command
      .add_option(
          "what", options->settings.what,
          "surface, report (its Table 6.7 and Graph 6.1), render (which needs a surface first) or "
          "all")
      .choices({"surface", "report", "render", "all"})
      .type_name("WHAT")
      .group("Main");
  command.add_option("--torus", options->settings.balls, "balls on the torus (1032)")
      .range(1, 1000000)
      .type_name("N")
      .group("Main");
  command
      .add_option("--balls", options->settings.ball_file,
                  "balls from a JSON file instead of the torus")
      .type_name("FILE")
      .group("Main");
  command.add_option("--grid", options->settings.grid, "grid points along an axis (128)")
      .range(8, 4096)
      .type_name("N")
      .group("Main");
  std::vector<std::string> fields;
  for (const FieldKind kind : kFieldKinds) fields.emplace_back(field_name(kind));
  command
      .add_option(
          "--field", options->settings.field,
          fmt::format("field function of the balls: {} (gaussian)", fmt::join(fields, ", ")))
      .choices(fields)
      .type_name("FIELD")
      .group("Main");
  command.add_option("--spp", options->settings.samples, "samples per pixel (16)")
      .range(1, 65536)
      .type_name("N")
      .group("Main");
  command.add_option("--repeats", options->settings.repeats, "runs after the first (7)")
      .range(1, 1000)
      .type_name("N")
      .group("Main");
  add_json(command, options->json);
  set_action(line, command, [&line, options] { return run_bench(line, *options); });
}

}  // namespace polymorph
