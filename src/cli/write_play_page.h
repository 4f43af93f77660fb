// The HTML page that plays a morph in a browser (`mesh --html`, `strip --html`), and the
// preparation of a scene for HTML pages.
#pragma once

#include <filesystem>

#include "cli/command_line.h"
#include "scene/scene.h"
#include "sequence/prepare/engine_scene.h"

namespace polymorph {

/// Checks before any work that the path is an .html file that may be written. Errors: kUsage,
/// kOutput.
Status check_play_page(const CommandLine& line, const std::filesystem::path& path);

/// Prepares a scene for a page, with at most kPlayResolution cells along an actor's longest side.
/// Errors: those of prepare_on_engine(); kInput if an actor has a mesh sequence.
Result<EngineScene> prepare_page(const CommandLine& line, Scene scene);

/// Writes the page that plays a scene, and prints the number of actors and frames and the size of
/// the file. Errors: those of prepare_page() and write_file().
Status write_play_page(const CommandLine& line, Scene scene, const std::filesystem::path& path);

}  // namespace polymorph
