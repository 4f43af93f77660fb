// Labels of balls: the part of an object that a ball belongs to, and the matching of two objects'
// parts.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "model/model.h"
#include "morph/plan.h"

namespace polymorph {

/// For each ball the label (index into model.label_names) of the nearest face.
std::vector<std::uint32_t> face_labels(const Model& model, const std::vector<Ball>& balls);

/// One object's labels, for matching.
struct LabelledObject {
  std::string name;
  std::vector<std::string> labels;
};

/// Two objects' labels in one numbering: equal numbers belong together, kNoLabel has no partner.
struct LabelMatch {
  std::vector<std::int32_t> from, to;  ///< one per label of the object
};

/// `map` names partners ("teapot.spout": "penguin.beak", or just "spout": "beak", in either
/// direction); labels it does not name belong to the label of the same name.
LabelMatch match_labels(const LabelledObject& from, const LabelledObject& to,
                        const std::map<std::string, std::string>& map);

/// The label of each point of the surface between two objects: one number per point, of those in
/// `from_names` and `to_names` (one per ball of either object, in one numbering). A pair's share of
/// the field at the point goes to its source's label by 1 - u and to its target's by u; labels that
/// belong together count as one, and the larger of them gives the name. `balls` are those of
/// balls_at(plan, time). Errors: the engine's (field/extract_surface.h: to_status).
Result<std::vector<std::uint32_t>> label_points(const MorphPlan& plan, float time,
                                                const BallSet& balls,
                                                const std::vector<Vec3>& points,
                                                std::span<const std::uint32_t> from_names,
                                                std::span<const std::uint32_t> to_names,
                                                Engine& engine);

/// Errors (kInput): a name in `map` that no object of the chain has.
Status check_label_map(const std::vector<LabelledObject>& chain,
                       const std::map<std::string, std::string>& map);

}  // namespace polymorph
