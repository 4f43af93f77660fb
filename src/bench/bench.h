// Benchmarks of the program itself: a standard surface, the report's table and graph, rendering.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "base/json.h"
#include "base/result.h"
#include "kernels/engine.h"

namespace polymorph {

struct BenchSettings {
  std::string what = "all";  ///< surface, report, render or all
  std::string field = "gaussian";
  std::filesystem::path ball_file;  ///< balls instead of the torus
  int balls = 1032, grid = 128, repeats = 7, width = 640, height = 480, samples = 16;
};

/// Runs the benchmarks on an engine, whose device has a name. `print` gets each line of the table
/// when it is measured; the result is a JSON report of all. Errors: kInput (the balls' file),
/// kResource.
Result<JsonValue> run_benchmarks(const BenchSettings& settings, const std::string& device,
                                 Engine& engine,
                                 const std::function<void(const std::string&)>& print);

}  // namespace polymorph
