// Morph analysis of a scene's legs, or of a sequence of mesh files.
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "analyze/analyze.h"
#include "analyze/true_points.h"
#include "sequence/prepare/prepared_scene.h"
#include "sequence/run/frames.h"
#include "sequence/run/true_errors.h"

namespace polymorph {

/// Called before each frame; false stops the analysis with kResumable.
using AnalyzeProgress = std::function<bool(int done, int count)>;

/// Each leg of each actor, actor by actor: its volumetric stage, from balls to balls, at `frames`
/// even times with both ends (0: as many as the leg has in the scene), and the boundary stages
/// beside it. A leg that is left on the way ends there. With `truth`, legs between models that it
/// knows are also judged by its points.
Result<std::vector<Analysis>> analyze_scene(const PreparedScene& prepared, Engine& engine,
                                            int frames, const AnalyzeProgress& progress,
                                            const Truth* truth = nullptr);

/// Meshes of a morph that some program made.
struct MeshMorph {
  FramePattern frames;
  std::filesystem::path source, target;  ///< its objects; empty: the first and the last mesh
  TruePair truth;                        ///< true points of both
};

/// Meshes in the order of their numbers, time going evenly. Errors (kInput): fewer than two,
/// unreadable ones.
Result<std::vector<Analysis>> analyze_meshes(const MeshMorph& morph,
                                             const AnalyzeProgress& progress);

}  // namespace polymorph
