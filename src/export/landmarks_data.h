// Data of the page on which landmarks are clicked.
#pragma once

#include "base/result.h"
#include "interchange/landmarks_page.h"
#include "kernels/engine.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// Makes the page's data: the objects of each leg, coloured to show the present correspondence. The
/// colour of a source point depends on its position; a target point has the colour of the source
/// point that it comes from. Errors: kInput if an object is flattened or no leg begins at an
/// object; those of the engine.
Result<LandmarksPage> make_landmarks_page(const PreparedScene& prepared, Engine& engine);

}  // namespace polymorph
