// Benchmark of correspondence: pairs of models with true points, morphed by this program or by
// another one, in one table.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "analyze/analysis_report.h"
#include "base/json.h"
#include "base/result.h"
#include "kernels/engine.h"
#include "scene/load_scene.h"
#include "sequence/prepare/memory_estimate.h"

namespace polymorph {

struct BenchMorphSettings {
  std::filesystem::path truth;  ///< a file of true points with pairs, or its folder (load_truth())
  /// Meshes of another program, as "theirs/{pair}.####.ply", where {pair} stands for FROM-TO;
  /// empty: this program's own morphs.
  std::string meshes;
  std::vector<Override> overrides;  ///< settings of the scenes
  int frames = 9;                   ///< frames of each morph, ends included
  std::filesystem::path cache;      ///< folder; empty: none
  MemoryLimit memory;
};

/// Analyses of the pairs, in their order.
struct BenchMorphReport {
  std::vector<Analysis> morphs;
  JsonValue json;  ///< analysis_json() of them, and "all": the means
};

/// Measures every pair and prints a line for each, then one for all: shares and errors of points
/// are means over all points, the rest are means over the pairs where they are known. `keep_going`
/// is asked before each frame; false ends it with kResumable. Errors: kInput (no pairs, pairs
/// without points in common, models, meshes), kUsage (an override), the engine's.
Result<BenchMorphReport> bench_morph(const BenchMorphSettings& settings, Engine& engine,
                                     const std::function<void(const std::string&)>& print,
                                     const std::function<bool()>& keep_going);

}  // namespace polymorph
