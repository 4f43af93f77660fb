// Explanation of a changed frame in one sentence, from the layers and headers of both images.
#pragma once

#include <string>
#include <vector>

#include "image/image.h"
#include "kernels/types.h"

namespace polymorph {

// Names of the header entries that the renderer writes for explain_change().
inline constexpr const char* kCameraAttribute =
    "polymorph/camera";  ///< output of pinhole_view_text()
/// Number of balls per object, as in "cube 12, sphere 16".
inline constexpr const char* kBallsAttribute = "polymorph/balls";
/// Digest of the plans, which say which balls become which.
inline constexpr const char* kPlanAttribute = "polymorph/plan";
/// Id and name per object, as in "2 penguin, 3 cube".
inline constexpr const char* kObjectsAttribute = "polymorph/objects";
inline constexpr const char* kSamplesAttribute = "polymorph/samples";  ///< int; samples per pixel
inline constexpr const char* kSeedAttribute = "polymorph/seed";        ///< string; decimal number

/// A pinhole camera. `up` and `forward` are perpendicular unit vectors.
struct PinholeView {
  Vec3 position, forward, up;
  float tan_half_fov_y = 0;
};
/// Encodes a view as ten numbers: position, forward, up and tan_half_fov_y.
std::string pinhole_view_text(const PinholeView& view);
/// Parses the output of pinhole_view_text(). Returns false if the text does not begin with ten
/// numbers.
bool parse_view(const std::string& text, PinholeView& view);

/// Facts that the two images do not contain; each may be unknown.
struct ChangeContext {
  bool surfaces_known = false;  ///< the digests of both surfaces are known
  bool surfaces_equal = false;  ///< these digests are equal
  float cell = 0;               ///< edge of a marching-cubes cell, in world units; 0 = unknown
  std::vector<Vec3> balls;      ///< centres in the new frame, in world space; empty = unknown
};

/// Describes in one sentence what changed from `reference` to `actual`: a missing ball, the plan,
/// the camera, the surface, colour or texture of an object, how an object reflects, light,
/// brightness or gamma, noise, rounding. Empty if the images differ in size or channels or contain
/// NaN or infinities, and if they are equal, unless `context` says that the surfaces differ. The
/// result is an estimate: of several changes, it names the one that explains most.
std::string explain_change(const Image& actual, const Image& reference,
                           const ChangeContext& context = {});

}  // namespace polymorph
