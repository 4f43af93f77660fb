// Who becomes whom, and where each ball is at a time (docs/method.md, Plan and Time).
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/types.h"
#include "scene/scene.h"

namespace polymorph {

/// One moving ball: a share of ball `from` that becomes a share of ball `to`. The shares of the
/// pairs that leave one ball, and of those that reach one, each sum to 1, so both ends give the
/// objects' own fields.
struct Pair {
  std::uint32_t from = 0, to = 0;
  float from_share = 1, to_share = 1;  ///< (0, 1]
};

struct MorphPlan {
  FieldKind kind = FieldKind::kGaussian;
  std::vector<Ball> from, to;
  std::vector<Pair> pairs;
};

/// Both ball lists must not be empty. Deterministic; `index` also depends on the seed.
MorphPlan plan_morph(std::vector<Ball> from, std::vector<Ball> to, FieldKind kind,
                     const PlanSettings& settings);

/// The balls at u in [0, 1] (already eased), one a pair, in pair order. u = 0 and u = 1 give the
/// fields of `from` and `to` exactly. Centres move on straight lines, the cube of a ball's size
/// (a^-3/2) is linear, and so is its strength: w for inverse-square balls, w + ln(share) for
/// Gaussian ones.
std::vector<Ball> balls_at(const MorphPlan& plan, float u);

/// Eased time: linear, smoothstep (3t^2 - 2t^3) or quintic (6t^5 - 15t^4 + 10t^3); maps [0, 1] onto
/// itself.
float ease(Easing easing, float t);

}  // namespace polymorph
