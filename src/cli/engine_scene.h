// Scenes of a command, prepared on the device that its options name.
#pragma once

#include <memory>
#include <string>

#include "cli/command_line.h"
#include "kernels/engine.h"
#include "sequence/prepare/prepare.h"

namespace polymorph {

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

}  // namespace polymorph
