#include "bench/bench.h"

#include "base/parallel.h"
#include "bench/bench_run.h"

namespace polymorph {

JsonValue print_row(const Bench& bench, const std::string& name, const Timing& t,
                    const std::string& note) {
  bench.print_line("{:<28} {:>9.2f} ms  ({:.2f} - {:.2f})  {}\n", name, t.median * 1e3, t.low * 1e3,
                   t.high * 1e3, note);
  return {{"name", name},
          {"median_ms", t.median * 1e3},
          {"min_ms", t.low * 1e3},
          {"max_ms", t.high * 1e3},
          {"note", note}};
}

Result<JsonValue> run_benchmarks(const BenchSettings& settings, const std::string& device,
                                 Engine& engine,
                                 const std::function<void(const std::string&)>& print) {
  Bench bench{settings, print};
  bench.print_line("device {}, {} threads, median of {} runs (min - max)\n", device, thread_count(),
                   settings.repeats);
  Mesh mesh;
  const bool runs_all = settings.what == "all";
  // Rendering needs the mesh that bench_surface() extracts.
  if (settings.what != "report") PM_TRY_STATUS(bench_surface(bench, device, engine, mesh));
  if (runs_all || settings.what == "report") PM_TRY_STATUS(bench_report_figures(bench, engine));
  if (runs_all || settings.what == "render") PM_TRY_STATUS(bench_render(bench, device, mesh));
  return JsonValue{{"device", device}, {"threads", thread_count()}, {"rows", bench.rows}};
}

}  // namespace polymorph
