// Pages of a scene in a browser: what all need, and those that play its morph, for `mesh --html`
// and `strip --html`.
#pragma once

#include <filesystem>
#include <memory>

#include "cli/command_line.h"
#include "kernels/engine.h"
#include "scene/scene.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// Before any work: is it an .html file that may be written? Errors: kUsage, kOutput.
Status check_play_page(const CommandLine& line, const std::filesystem::path& path);

/// A scene made ready for a page, and the engine that its surfaces are asked of.
struct PageScene {
  std::unique_ptr<Engine> engine;
  PreparedScene prepared;
};

/// Prepares a scene for a page, with at most kPlayResolution cells along an actor's longest side,
/// and logs its warnings. Errors: those of make_engine() and prepare_scene().
Result<PageScene> prepare_page(const CommandLine& line, Scene scene);

/// Writes the page of a scene, with at most kPlayResolution cells along an actor's longest side,
/// and says how large it is. Errors: those of prepare_scene() and write_file().
Status write_play_page(const CommandLine& line, Scene scene, const std::filesystem::path& path);

}  // namespace polymorph
