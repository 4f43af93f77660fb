// Field values at many points, with progress that is shown.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"

namespace polymorph {

/// Samples the field as Engine::sample() does, in runs of points. An activity shows `name` and the
/// percentage done. The values do not depend on the runs.
/// Errors: kResource.
Result<std::vector<float>> sample_field(Engine& engine, const BallSet& balls,
                                        const std::vector<Vec3>& points,
                                        const ExtractSettings& settings, const std::string& name);

/// Returns a number of points that are sampled in a second or less, in a field of `balls` balls.
std::size_t points_per_second(std::size_t balls);

}  // namespace polymorph
