// Field values at many points, with progress that is shown.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"

namespace polymorph {

/// Samples the field as Engine::sample() does, in parts of sampled_at_once() points, each an
/// activity that says `name` and how much of it is done. The values do not depend on the parts.
/// Errors: kResource.
Result<std::vector<float>> sample_field(Engine& engine, const BallSet& balls,
                                        const std::vector<Vec3>& points,
                                        const ExtractSettings& settings, const std::string& name);

/// Number of points that are sampled in a second or less, of a field of so many balls.
std::size_t sampled_at_once(std::size_t balls);

}  // namespace polymorph
