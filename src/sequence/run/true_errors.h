// True errors: how far a leg, or meshes with corresponding points, bring known points from where
// they belong.
#pragma once

#include <optional>

#include "analyze/analyze.h"
#include "analyze/true_points.h"
#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"
#include "scene/scene.h"

namespace polymorph {

/// Two entries of a truth's file; null: nothing is known.
struct TruePair {
  const TrueModel* from = nullptr;
  const TrueModel* to = nullptr;
};

/// An object of a leg as its scene names it.
struct NamedObject {
  const ObjectSettings& settings;
  const Model& model;  ///< moved to its place
};

/// Measures a leg between two objects, whose motion is not left on the way. Nothing if the two have
/// no true points in common. Errors: kInput (a model cannot be read again), the engine's.
Result<std::optional<TrueErrors>> measure_true_errors(const Leg& leg, const NamedObject& from,
                                                      const NamedObject& to, const TruePair& truth,
                                                      Engine& engine);

/// Measures a morph from the mesh `first` to the mesh `last`. The models of the true points are
/// laid over them by their boxes: same diagonal, same middle. Only the number of points is known
/// where the meshes do not correspond. Errors: kInput (a model cannot be read).
Result<std::optional<TrueErrors>> measure_true_errors(const Mesh& first, const Mesh& last,
                                                      const TruePair& truth);

}  // namespace polymorph
