// Field values at many points, with progress that is shown.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"

namespace polymorph {

/// Samples the field as Engine::sample() does, in runs of points; this does not change the values.
/// An activity (base/activity.h) shows `name` and the percentage done. Errors: kResource.
Result<std::vector<float>> sample_field(Engine& engine, const BallSet& balls,
                                        const std::vector<Vec3>& points,
                                        const ExtractSettings& settings, const std::string& name);

/// Estimates the number of points at which a field of `balls` balls is sampled in a second.
std::size_t points_per_second(std::size_t balls);

}  // namespace polymorph
