// Scenes of a command: the options that change their frames, shared by render, submit, status and
// strip, and the engine that they are prepared on. A frame is current only if it was rendered with
// the same options.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/frames.h"
#include "cli/command_line.h"
#include "image/display_view.h"
#include "kernels/engine.h"
#include "sequence/prepare/prepare.h"

namespace polymorph {

struct SceneOptions {
  bool preview = false, draft = false;  ///< --draft is a preview, too
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

/// Parses --frames of a scene with `count` frames, by default all of them. Errors: those of
/// parse_frames().
Result<std::vector<int>> parse_frame_option(const std::string& frames, int count);

/// A prepared scene, and the engine that makes its surfaces.
struct EngineScene {
  std::unique_ptr<Engine> engine;
  std::string device;  ///< name of the engine's device
  PreparedScene prepared;
};

/// Prepares a scene on the device that the command line names, for frames of which `pictures` are
/// in memory at a time, and logs its warnings. Errors: those of make_engine() and prepare_scene().
Result<EngineScene> prepare_on_engine(const CommandLine& line, const Scene& scene,
                                      std::size_t pictures = 0, Sharing sharing = Sharing::kAlike);

/// Converts the options back to arguments of a command line.
std::vector<std::string> to_arguments(const SceneOptions& options);

}  // namespace polymorph
