// Data of a page that plays a scene's morph: each leg at the times of its frames.
#pragma once

#include "base/result.h"
#include "interchange/play_page.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// Maximum number of cells along the longest side of an actor's box on the grid from which a
/// browser extracts surfaces.
inline constexpr int kPlayResolution = 64;

/// Checks that no actor has a mesh sequence, which pages cannot play. Errors: kInput.
Status check_has_no_mesh_sequence(const PreparedScene& prepared);

/// Makes the page's data. Surfaces have the cells that the scene was prepared with. An object that
/// is an unfinished morph, left before its end, gets the colours that this morph has at that time.
/// Errors: kResource.
Result<PlayPage> make_play_page(const PreparedScene& prepared, Engine& engine);

}  // namespace polymorph
