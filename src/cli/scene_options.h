// The options that change a scene's frames, alike for render, submit and status: they decide which
// frames are current.
#pragma once

#include <string>
#include <vector>

#include "cli/command_line.h"
#include "sequence/run/frames.h"

namespace polymorph {

struct SceneOptions {
  bool preview = false, denoise = false;
  int samples = 0;      ///< 0 = the scene's
  double noise = -1;    ///< negative = the scene's
  long long seed = -1;  ///< negative = the scene's
  std::string aovs, isa;
  std::vector<std::string> sets;
};

/// --preview in group Main; --spp, --noise, --denoise, --aovs, --seed and --set in Scene; --isa in
/// Farm.
void add_scene_options(Command command, SceneOptions& options);

/// --set and those options that are settings of the scene file. Errors: kUsage.
Result<std::vector<Override>> overrides_of(const SceneOptions& options);

/// All other options, applied to a scene that was loaded with those overrides.
void apply_scene_options(Scene& scene, const SceneOptions& options);

/// The scene with these options applied. Errors: those of load_scene(), kUsage.
Result<Scene> load_scene_with(const std::string& file, const SceneOptions& options);

/// Converts the options back to words of a command line.
std::vector<std::string> to_arguments(const SceneOptions& options);

}  // namespace polymorph
