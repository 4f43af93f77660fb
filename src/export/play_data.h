// Data of a page that plays a scene's morph: each leg at the times of its frames.
#pragma once

#include "base/result.h"
#include "interchange/play_page.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// Maximum number of cells along the longest side of an actor's box, from which a browser extracts
/// surfaces.
inline constexpr int kPlayResolution = 64;

/// Checks that no actor has a mesh sequence, which pages cannot play. Errors: kInput.
Status check_has_no_mesh_sequence(const PreparedScene& prepared);

/// Makes the page's data. Surfaces have the cells that the scene was prepared with. An object that
/// is an unfinished morph (balls in flight) gets the colours that the morph has when it is left.
/// Errors: kResource.
Result<PlayPage> make_play_page(const PreparedScene& prepared, Engine& engine);

}  // namespace polymorph
