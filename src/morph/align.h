// Rigid alignment (weighted Procrustes) of two objects before their balls are paired.
#pragma once

#include <span>

#include "morph/cost.h"
#include "morph/linear.h"
#include "morph/transport.h"

namespace polymorph {

/// The turn of `a` at which it is carried to `b` most cheaply: plan and weighted Procrustes in
/// turns, from the identity and the 24 turns of a cube, on a few dozen representatives. The
/// identity where no turn makes the plan `gain` cheaper. Among turns that are as good, the
/// smallest.
Mat3 find_rotation(const CostSide& a, const CostSide& b, float label_cost, double gain);

/// The turn that makes the flows' distances least, both sides about their origins.
Mat3 fit_rotation(const CostSide& a, const CostSide& b, std::span<const TransportFlow> flows);

}  // namespace polymorph
