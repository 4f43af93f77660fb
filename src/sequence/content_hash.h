// Content hash of everything that decides a frame's pixels; files that carry it are up to date.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "base/program_identity.h"
#include "image/image.h"
#include "model/model.h"
#include "scene/scene.h"

namespace polymorph {

/// The scene's settings, what is in its files, and the program. Contents count and not spellings:
/// neither where the files lie nor from which folder the program was started changes it, and of
/// `output` only how the pixels are encoded. `models`: as load_models() gives them.
std::string content_hash(const Scene& scene, std::span<const Model> models,
                         const Image* environment, std::string_view program = program_identity());

/// The part of it that is the same in all frames of a film: what is in the scene's files, and the
/// program.
std::string inputs_hash(const Scene& scene, std::span<const Model> models, const Image* environment,
                        std::string_view program = program_identity());
/// And the other part: the settings as text.
std::string settings_text(const Scene& scene);

}  // namespace polymorph
