// Cost estimate of a sequence, from measured frames: time, memory and disk.
#pragma once

#include <optional>
#include <span>

#include "base/result.h"
#include "film/run_report.h"
#include "kernels/engine.h"
#include "render/render.h"
#include "render/sample_range.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// Renders up to three evenly spaced frames with an eighth of the samples or, if `part` is given,
/// with the first block of its samples. Scales the tracing time to all samples. Writes no files.
/// With image.noise the estimate assumes all samples, though most pixels need fewer. Errors:
/// kResource, kOutput.
Result<FrameEstimate> estimate_frames(const PreparedScene& prepared, Engine& engine,
                                      Renderer& renderer, std::span<const int> frames,
                                      const std::optional<SampleRange>& part = {});

}  // namespace polymorph
