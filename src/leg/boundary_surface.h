// Surface of a boundary stage, in which a model turns into its balls' surface or back, at a moment.
#pragma once

#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"
#include "scene/scene.h"

namespace polymorph {

/// Makes the boundary stage of an object whose members `balls` and `closest` are set. `surface`:
/// surface of its balls. If a projection leaves more than 2 % of the visible area off that surface
/// (Projection::arrived, leg/project.h), the stage is a blend instead. Errors: the engine's.
Result<BoundaryStage> make_boundary_stage(const PreparedObject& object, BoundaryMethod method,
                                          Mesh surface, const LegSettings& settings,
                                          Engine& engine);

/// A moment of a boundary stage.
struct BoundaryState {
  bool leaving = true;  ///< whether the object is the leg's source; else it is its target
  float boundary = 1;   ///< 1: the whole model; 0: its balls
  float growth = 0;     ///< size of the balls; 0: absent; 1: full size
};

/// Meshes that a boundary stage shows at a moment. Any member may be empty.
struct BoundarySurface {
  std::vector<Ball> balls;           ///< crossfade only: the balls at their present size
  Mesh surface;                      ///< surface of the balls, or its blend with the model
  std::vector<Vec3> points;          ///< points of the model if it shows, else empty
  std::vector<Vec3> corner_normals;  ///< 3 per triangle of the model; empty: the model's own
};
/// Computes the meshes of a boundary stage at a moment. Errors: kResource.
Result<BoundarySurface> boundary_surface(const Leg& leg, const BoundaryState& moment,
                                         Engine& engine);

/// Computes the displacement of the model's points from the positions `points` to their positions
/// at the moment with BoundaryState::boundary = `boundary`; empty unless the stage is a projection.
std::vector<Vec3> boundary_displacement(const PreparedObject& object,
                                        const std::vector<Vec3>& points, float boundary);

/// Makes a mesh of the model's triangles with its points moved to `points` and smooth normals.
Mesh model_mesh(const Model& model, const std::vector<Vec3>& points);

}  // namespace polymorph
