// Morph analysis of a scene's legs (leg/leg.h), or of a sequence of mesh files.
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "analyze/analyze.h"
#include "analyze/true_points.h"
#include "base/frames.h"
#include "inspect/true_errors.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// Callback before each frame: `done` of `count` frames are measured. If it returns false, the
/// analysis stops with kResumable.
using AnalyzeProgress = std::function<bool(int done, int count)>;

/// Analyzes each leg of each actor: its volumetric stage at `frames` evenly spaced times including
/// both ends (0: as many as the leg has frames in the scene), and its boundary stages. If a leg is
/// left early for the next one, it is measured up to that time. An actor that mixes three objects
/// or more is one morph over the whole film. If `truth` is not null, legs between two of its models
/// are also measured at the models' true points. Errors: kInput if no actor morphs.
Result<std::vector<Analysis>> analyze_scene(const PreparedScene& prepared, Engine& engine,
                                            int frames, const AnalyzeProgress& progress,
                                            const Truth* truth = nullptr);

/// Meshes of a morph made by any program.
struct MeshMorph {
  FramePattern frames;                   ///< paths of the mesh files
  std::filesystem::path source, target;  ///< files of both objects; empty: the first and last mesh
  TruePair truth;                        ///< true points of both objects, if known
};

/// Analyzes meshes in the order of their numbers, at evenly spaced times. Errors: kInput for fewer
/// than two meshes or an unreadable one.
Result<std::vector<Analysis>> analyze_meshes(const MeshMorph& morph,
                                             const AnalyzeProgress& progress);

}  // namespace polymorph
