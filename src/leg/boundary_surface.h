// Surface of a boundary stage at a moment: a model that becomes its balls' surface, or the other
// way round.
#pragma once

#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"
#include "scene/scene.h"

namespace polymorph {

/// Makes the stage of an object whose balls and `closest` are set; `surface` is its balls'. A
/// projection that leaves too much of the mesh off the surface becomes a blend. Errors: the
/// engine's.
Result<BoundaryStage> make_boundary_stage(const PreparedObject& object, BoundaryMethod method,
                                          Mesh surface, const LegSettings& settings,
                                          Engine& engine);

/// A moment of a boundary stage.
struct BoundaryMoment {
  bool leaving = true;  ///< stage of the leg's source, else of its target
  float boundary = 1;   ///< 1 the whole model .. 0 its balls
  float growth = 0;     ///< size of the balls: 0 not there .. 1 whole
};

/// Meshes that a boundary stage shows at a moment.
struct BoundarySurface {
  std::vector<Ball> balls;           ///< crossfade: at their present size
  Mesh surface;                      ///< surface of the balls, or blended with the model
  std::vector<Vec3> points;          ///< points of the model where it shows, else empty
  std::vector<Vec3> corner_normals;  ///< normals of those points; empty: the model's own
};
/// Errors: kResource.
Result<BoundarySurface> boundary_surface(const Leg& leg, const BoundaryMoment& moment,
                                         Engine& engine);

/// Displacement of the model's points `points` until the moment at which the model is `boundary`;
/// empty unless the stage moves the model's own mesh.
std::vector<Vec3> boundary_displacement(const PreparedObject& object,
                                        const std::vector<Vec3>& points, float boundary);

/// A model with its points moved, with smooth normals.
Mesh model_mesh(const Model& model, const std::vector<Vec3>& points);

}  // namespace polymorph
