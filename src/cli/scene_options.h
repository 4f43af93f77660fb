// The options that change a scene's frames, alike for render, submit and status: they decide which
// frames are current.
#pragma once

#include <string>
#include <vector>

#include "cli/command_line.h"
#include "image/display_view.h"
#include "sequence/run/frames.h"

namespace polymorph {

struct SceneOptions {
  bool preview = false, draft = false;  ///< --draft is a preview, too
  int samples = 0;                      ///< 0 = the scene's
  DisplayView shown;                    ///< view for which PNGs, strips, GIFs and movies are made
  std::vector<std::string> sets;
};

/// Adds --preview and --draft to the group Main, and --spp, --display, --view and --set to Scene.
void add_scene_options(Command command, SceneOptions& options);

/// Applies the options to a scene that was loaded with the overrides of --set.
void apply_scene_options(Scene& scene, const SceneOptions& options);

/// Loads a scene and applies these options. Errors: those of load_scene(), kUsage.
Result<Scene> load_scene_with(const std::string& file, const SceneOptions& options);

/// Converts the options back to words of a command line.
std::vector<std::string> to_arguments(const SceneOptions& options);

}  // namespace polymorph
