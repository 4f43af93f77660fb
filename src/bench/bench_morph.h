// Benchmark of correspondence: measures morphs between pairs of models with known corresponding
// points. The morphs are those of this program or of another one.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "analyze/analysis_report.h"
#include "assets/memory_estimate.h"
#include "base/json.h"
#include "base/result.h"
#include "kernels/engine.h"
#include "scene/load_scene.h"

namespace polymorph {

struct BenchMorphSettings {
  std::filesystem::path truth;  ///< a file of true points with pairs, or its folder (load_truth())
  /// Pattern of another program's meshes, such as "theirs/{pair}.####.ply", where {pair} stands for
  /// FROM-TO. Empty: this program's own morphs.
  std::string meshes;
  std::vector<Override> overrides;  ///< settings of the scenes
  int frames = 9;                   ///< frames of each morph, ends included
  std::filesystem::path cache;      ///< cache folder; empty: none
  MemoryLimit memory;               ///< limit of this run (assets/memory_estimate.h)
};

/// Results of the benchmark.
struct BenchMorphReport {
  std::vector<Analysis> morphs;  ///< one per pair, in the order of the file
  JsonValue json;                ///< analysis_json() of `morphs`, and their means as "all"
};

/// Measures every pair. Prints a line for each pair, and then a line with the means. The mean of a
/// metric of points is that over all points; the mean of any other metric is that over the pairs
/// for which it is known. `keep_going` is called before each frame; if it returns false, the error
/// is kResumable. Errors: kInput (no pairs, pairs without common points, models, meshes), kUsage
/// (an override), the engine's.
Result<BenchMorphReport> bench_morph(const BenchMorphSettings& settings, Engine& engine,
                                     const std::function<void(const std::string&)>& print,
                                     const std::function<bool()>& keep_going);

}  // namespace polymorph
