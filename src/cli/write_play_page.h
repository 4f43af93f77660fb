// Pages that play a scene's morph, for `mesh --html` and `strip --html`.
#pragma once

#include <filesystem>

#include "cli/command_line.h"
#include "scene/scene.h"

namespace polymorph {

/// Before any work: is it an .html file that may be written? Errors: kUsage, kOutput.
Status check_play_page(const CommandLine& line, const std::filesystem::path& path);

/// Writes the page of a scene, with at most kPlayResolution cells along an actor's longest side,
/// and says how large it is. Errors: those of prepare_scene() and write_file().
Status write_play_page(const CommandLine& line, Scene scene, const std::filesystem::path& path);

}  // namespace polymorph
