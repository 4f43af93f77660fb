// Morph analysis of a scene's legs, or of a sequence of mesh files.
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "analyze/analyze.h"
#include "sequence/prepare/prepared_scene.h"
#include "sequence/run/frames.h"

namespace polymorph {

/// Called before each frame; false stops the analysis with kResumable.
using AnalyzeProgress = std::function<bool(int done, int count)>;

/// Each leg of each actor, actor by actor: its volumetric stage, from balls to balls, at `frames`
/// even times with both ends (0: as many as the leg has in the scene), and the boundary stages
/// beside it. A leg that is left on the way ends there.
Result<std::vector<Analysis>> analyze_scene(const PreparedScene& prepared, Engine& engine,
                                            int frames, const AnalyzeProgress& progress);

/// Meshes as OBJ files in the order of their numbers, time going evenly. `source` and `target`
/// empty: the first and the last mesh. Errors (kInput): fewer than two, unreadable ones.
Result<std::vector<Analysis>> analyze_meshes(const FramePattern& pattern,
                                             const std::filesystem::path& source,
                                             const std::filesystem::path& target,
                                             const AnalyzeProgress& progress);

}  // namespace polymorph
