// Benchmarks of the program: extraction of a standard surface; the measurements of Table 6.7 and
// Graph 6.1 in Gilbert's report (2010; scene/scene.h); and rendering.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "base/json.h"
#include "base/result.h"
#include "kernels/engine.h"

namespace polymorph {

/// Settings of the command `bench`.
struct BenchSettings {
  std::string what = "all";         ///< surface, report, render or all
  std::string field = "gaussian";   ///< field function of the balls on the torus
  std::filesystem::path ball_file;  ///< file of the balls (field/balls_io.h); empty: use a torus
  std::size_t max_memory = 0;       ///< bytes that an engine may use; 0: no limit
  /// `balls`: on the torus; `grid`: points per axis; `repeats`: measured runs of each benchmark;
  /// `width`, `height`: of the picture in pixels; `samples`: per pixel.
  int balls = 1032, grid = 128, repeats = 7, width = 640, height = 480, samples = 16;
};

/// Runs the benchmarks on `engine`, which make_engine() (device/device.h) made for `device`. Calls
/// `print` with each line of the table as soon as it is measured. Returns all results as JSON.
/// Errors: kInput (the file of balls), kResource.
Result<JsonValue> run_benchmarks(const BenchSettings& settings, const std::string& device,
                                 Engine& engine,
                                 const std::function<void(const std::string&)>& print);

}  // namespace polymorph
