// Labels of balls: the face group that each ball belongs to, and the matching of two objects'
// groups.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "model/model.h"
#include "morph/flow.h"
#include "morph/plan.h"

namespace polymorph {

/// Finds the label, an index into model.label_names, of the face nearest to each ball; 0 if the
/// model has no faces.
std::vector<std::uint32_t> face_labels(const Model& model, const std::vector<Ball>& balls);

/// One object's labels, for matching.
struct LabelledObject {
  std::string name;
  std::vector<std::string> labels;
};

/// Two objects' labels in a common numbering: labels with equal numbers match, and a label with the
/// number kNoLabel (morph/cost.h) matches none.
struct LabelMatch {
  std::vector<std::int32_t> from, to;  ///< per label of the object, its number or kNoLabel
};

/// Matches two objects' labels. `map` pairs names of labels, in either direction. A name is
/// OBJECT.LABEL or just LABEL: "teapot.spout": "penguin.beak", or "spout": "beak". A label that
/// `map` does not name matches labels of the same name.
LabelMatch match_labels(const LabelledObject& from, const LabelledObject& to,
                        const std::map<std::string, std::string>& map);

/// The labels of both objects' balls, as indices into one list of names.
struct BallLabels {
  std::vector<std::uint32_t> from, to;
};

/// Finds the label of each point of the surface between two objects at a moment. Each pair of balls
/// has its share of the field at the point as a weight. It adds (1 - u) of this weight to its
/// source ball's label and u to its target ball's, where u is the pair's eased progress. The
/// weights of labels that match (MorphPlan::from_labels) are summed. Of the matching labels with
/// the largest sum, the one with the largest weight of its own is returned. `balls`:
/// balls_at(moment.plan, moment.time). Errors: the engine's (field/extract_surface.h: to_status).
Result<std::vector<std::uint32_t>> label_points(PlanMoment moment, const BallSet& balls,
                                                const std::vector<Vec3>& points,
                                                const BallLabels& names, Engine& engine);

/// Checks that each name in `map` is a label of an object of the chain. Errors: kInput.
Status check_label_map(const std::vector<LabelledObject>& chain,
                       const std::map<std::string, std::string>& map);

}  // namespace polymorph
