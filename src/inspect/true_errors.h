// True errors: how far from their true partners a morph moves known points. The morph is a leg, or
// a pair of meshes with corresponding vertices.
#pragma once

#include <optional>

#include "analyze/analyze.h"
#include "analyze/true_points.h"
#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"
#include "scene/scene.h"

namespace polymorph {

/// The entries of a morph's source and target in a file of true points; null: not in the file.
struct TruePair {
  const TrueModel* from = nullptr;
  const TrueModel* to = nullptr;
};

/// An object of a leg with its settings in the scene.
struct NamedObject {
  const ObjectSettings& settings;
  const Model& model;  ///< model in scene coordinates
};

/// Measures a leg that reaches its target. Returns nullopt if its objects have no true points in
/// common. Errors: kInput if a model cannot be read again; those of the engine.
Result<std::optional<TrueErrors>> measure_true_errors(const Leg& leg, const NamedObject& from,
                                                      const NamedObject& to, const TruePair& truth,
                                                      Engine& engine);

/// Measures a morph from the mesh `first` to the mesh `last`. The models of the true points are
/// scaled and moved so that their boxes have the diagonals and centres of the meshes' boxes. If the
/// meshes do not correspond (analyze/distortion.h), only TrueErrors::points is set. Returns nullopt
/// if a mesh has no triangles or the models have no true points in common. Errors: kInput if a
/// model cannot be read.
Result<std::optional<TrueErrors>> measure_true_errors(const Mesh& first, const Mesh& last,
                                                      const TruePair& truth);

}  // namespace polymorph
