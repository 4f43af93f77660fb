// Timing and output of benchmark runs.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "base/stopwatch.h"
#include "bench/bench.h"
#include "kernels/mesh.h"

namespace polymorph {

/// A run of benchmarks: its settings, the function that prints its table, and the rows of its JSON
/// result so far.
struct Bench {
  const BenchSettings& settings;
  const std::function<void(const std::string&)>& print;
  JsonValue rows = JsonValue::array();

  template <class... Args>
  void print_line(fmt::format_string<Args...> text, Args&&... args) const {
    print(fmt::format(text, std::forward<Args>(args)...));
  }
};

/// Minimum, median and maximum of the times of several runs, in seconds.
struct Timing {
  double low = 0, median = 0, high = 0;
};

/// Returns the median; of an even number of values, the larger one of the two in the middle.
inline double median_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}
inline Timing timing_of(const std::vector<double>& seconds) {
  const auto [low, high] = std::minmax_element(seconds.begin(), seconds.end());
  return {*low, median_of(seconds), *high};
}

/// Calls `run`, which returns a Status, once to warm up and then `repeats` times, which are timed.
template <class F>
Result<Timing> time_runs(int repeats, const F& run) {
  std::vector<double> seconds;
  for (int i = 0; i <= repeats; ++i) {
    const Stopwatch stopwatch;
    PM_TRY_STATUS(run());
    const double elapsed = stopwatch.seconds();
    if (i > 0) seconds.push_back(elapsed);  // run 0 warms up
  }
  return timing_of(seconds);
}

/// Prints a line of the table, which ends in `note`, and returns it as a row of the JSON result.
JsonValue print_row(const Bench& bench, const std::string& name, const Timing& t,
                    const std::string& note);

/// Times the extraction of the surface of the balls that BenchSettings describe. Stores the mesh in
/// `mesh`, for bench_render().
Status bench_surface(Bench& bench, const std::string& device, Engine& engine, Mesh& mesh);
/// Repeats the measurements of the report's Table 6.7 and Graph 6.1.
Status bench_report_figures(Bench& bench, Engine& engine);
/// Times the rendering of a mesh on the CPU, and on `device` if that is a GPU.
Status bench_render(Bench& bench, const std::string& device, const Mesh& mesh);

}  // namespace polymorph
