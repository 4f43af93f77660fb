// Explanation of a changed frame in one sentence, from the layers and headers of both images.
#pragma once

#include <string>
#include <vector>

#include "image/image.h"
#include "kernels/types.h"

namespace polymorph {

// What the renderer notes in the headers of its frames, for this.
inline constexpr const char* kCameraAttribute = "polymorph/camera";    ///< camera_text()
inline constexpr const char* kBallsAttribute = "polymorph/balls";      ///< "cube 12, sphere 12"
inline constexpr const char* kPlanAttribute = "polymorph/plan";        ///< a digest
inline constexpr const char* kObjectsAttribute = "polymorph/objects";  ///< "2 penguin, 3 torus"
inline constexpr const char* kSamplesAttribute = "polymorph/samples";
inline constexpr const char* kSeedAttribute = "polymorph/seed";

/// A pinhole, as headers name it. `up` and `forward` are unit vectors at right angles.
struct PinholeView {
  Vec3 position, forward, up;
  float tan_half_fov_y = 0;
};
std::string view_text(const PinholeView& view);
/// False where the text is not one of view_text().
bool parse_view(const std::string& text, PinholeView& view);

/// Facts beside the two images; all may be unknown.
struct ChangeContext {
  bool surfaces_known = false, surfaces_equal = false;  ///< told by digests
  float cell = 0;           ///< edge of the surface's cells; 0 = unknown
  std::vector<Vec3> balls;  ///< centres, of the new frame
};

/// One sentence about what changed from `reference` to `actual`: a missing ball, the plan, the
/// camera, the surface, colour or texture of an object, how an object reflects, light, brightness
/// or gamma, noise, rounding. Empty where the images are equal, of different sizes or channels, or
/// hold NaN. A judgement, not a proof: of several changes the one that explains most is named.
std::string explain_change(const Image& actual, const Image& reference,
                           const ChangeContext& context = {});

}  // namespace polymorph
