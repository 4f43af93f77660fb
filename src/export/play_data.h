// Data of a page that plays a scene's morph: each leg at the frames' moments.
#pragma once

#include "base/result.h"
#include "interchange/play_page.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// Cells along the longest side of an actor's box, at most: what a browser makes surfaces of.
inline constexpr int kPlayResolution = 64;

/// Errors (kInput): an actor has a mesh sequence, which pages cannot play.
Status check_stands_still(const PreparedScene& prepared);

/// The surface's cells are those that the scene was prepared with. Objects that are balls in flight
/// get the colours that they have then. Errors: kResource.
Result<PlayPage> make_play_page(const PreparedScene& prepared, Engine& engine);

}  // namespace polymorph
