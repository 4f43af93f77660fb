// Declarations of all passes that an engine calls. ball_passes.h and level_set_passes.h define
// them; for CUDA, several source files instantiate them, because they take long to compile.
#pragma once

#include <memory>
#include <vector>

#include "ball_paths.h"
#include "ball_set.h"
#include "engine.h"
#include "mesh.h"
#include "morph_surface.h"
#include "types.h"

namespace polymorph {

template <class B>
struct Workspace;

/// Extracts the surface of balls. F: their Field (falloff.h).
template <class B, class F>
void extract_balls(Workspace<B>& work, const BallSet& set, const Grid& grid,
                   const ExtractSettings& settings, Mesh& mesh);

/// Evaluates the field of balls at points. `values`: one per point.
template <class B, class F>
void sample_balls(Workspace<B>& work, const BallSet& set, const std::vector<Vec3>& points,
                  const ExtractSettings& settings, std::vector<float>& values);

/// Interpolates the balls' attributes at points. `attributes`: one or two per ball; `values`: the
/// same number per point.
template <class B, class F>
void interpolate_balls(Workspace<B>& work, const BallSet& set,
                       const std::vector<BallAttribute>& attributes,
                       const std::vector<Vec3>& points, const ExtractSettings& settings,
                       std::vector<AttributeValues>& values);

/// Moves the balls along their paths and leaves them in backend memory.
template <class B>
BallSet move_balls(Workspace<B>& work, const std::shared_ptr<const BallPaths>& paths,
                   const MotionState& state, const std::vector<float>& eased_times);

/// Extracts the surface of an object from its distances.
template <class B>
void extract_distances(Workspace<B>& work, const std::shared_ptr<const DistanceGrid>& object,
                       const Grid& grid, const ExtractSettings& settings, Mesh& mesh);

/// Extracts the surface between two objects.
template <class B>
void extract_morph(Workspace<B>& work, const MorphSurface& surface, const Grid& grid,
                   const ExtractSettings& settings, Mesh& mesh);

/// Evaluates the maps of a regression at points. `values`: `maps` per point, point by point.
template <class B>
void sample_map(Workspace<B>& work, const std::shared_ptr<const Regression>& regression,
                const std::vector<Vec3>& points, std::vector<AttributeValues>& values);

}  // namespace polymorph
