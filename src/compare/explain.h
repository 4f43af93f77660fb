// Explanation of a changed frame in one sentence, from the layers and headers of both images.
#pragma once

#include <string>
#include <vector>

#include "image/image.h"
#include "kernels/types.h"

namespace polymorph {

// Names of the header entries that the renderer writes for explain_change().
inline constexpr const char* kCameraAttribute = "polymorph/camera";  ///< output of view_text()
inline constexpr const char* kBallsAttribute =
    "polymorph/balls";  ///< number of balls per object, "cube 12"
inline constexpr const char* kPlanAttribute = "polymorph/plan";  ///< digest of the plans
inline constexpr const char* kObjectsAttribute =
    "polymorph/objects";  ///< id and name per object, "2 penguin"
inline constexpr const char* kSamplesAttribute = "polymorph/samples";
inline constexpr const char* kSeedAttribute = "polymorph/seed";

/// A pinhole camera. `up` and `forward` are perpendicular unit vectors.
struct PinholeView {
  Vec3 position, forward, up;
  float tan_half_fov_y = 0;
};
/// Encodes a view as ten numbers.
std::string view_text(const PinholeView& view);
/// Parses the output of view_text(). Returns false for other texts.
bool parse_view(const std::string& text, PinholeView& view);

/// Facts that the two images do not contain; each may be unknown.
struct ChangeContext {
  bool surfaces_known = false, surfaces_equal = false;  ///< digests known, digests equal
  float cell = 0;           ///< edge of the surface's cells; 0 = unknown
  std::vector<Vec3> balls;  ///< centres in the new frame
};

/// Describes in one sentence what changed from `reference` to `actual`: a missing ball, the plan,
/// the camera, the surface, colour or texture of an object, how an object reflects, light,
/// brightness or gamma, noise, rounding. Empty if the images are equal, differ in size or channels,
/// or contain NaN. The result is an estimate: of several changes, it names the one that
/// explains most.
std::string explain_change(const Image& actual, const Image& reference,
                           const ChangeContext& context = {});

}  // namespace polymorph
