// Data of the page on which landmarks are clicked.
#pragma once

#include "base/result.h"
#include "interchange/landmarks_page.h"
#include "kernels/engine.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// The objects of each leg in colours of what becomes what by the scene's present map: the source
/// by position, the target by where its points come from. Errors: kInput where an object is
/// flattened or no leg begins at an object; the engine's.
Result<LandmarksPage> make_landmarks_page(const PreparedScene& prepared, Engine& engine);

}  // namespace polymorph
