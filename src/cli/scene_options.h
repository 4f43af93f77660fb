// Options that change a scene's frames, shared by render, submit, status and strip. A frame is
// current only if it was rendered with the same options.
#pragma once

#include <string>
#include <vector>

#include "cli/command_line.h"
#include "image/display_view.h"
#include "scene/scene.h"

namespace polymorph {

/// Values of the options that add_scene_options() adds.
struct SceneOptions {
  bool preview = false, draft = false;  ///< not both; a draft is a faster preview
  int samples = 0;                      ///< samples per pixel; 0: as in the scene
  DisplayView view;                     ///< view of PNGs, strips, GIFs and movies
  std::vector<std::string> sets;        ///< values of --set
};

/// Adds --preview and --draft to the group Main, and --spp, --display, --view and --set to Scene.
void add_scene_options(Command command, SceneOptions& options);

/// Applies the options to a scene that was loaded with the overrides of `sets`.
void apply_scene_options(Scene& scene, const SceneOptions& options);

/// Loads a scene with these options. Errors: those of load_scene(); kUsage.
Result<Scene> load_scene_with(const std::string& file, const SceneOptions& options);

/// Converts the options back to arguments of a command line.
std::vector<std::string> to_arguments(const SceneOptions& options);

}  // namespace polymorph
