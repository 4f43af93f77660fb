// A whole sequence of surfaces into one file, frame by frame.
#pragma once

#include <filesystem>
#include <memory>
#include <span>

#include "base/result.h"
#include "interchange/surface_frame.h"

namespace polymorph {

class SurfaceWriter {
 public:
  virtual ~SurfaceWriter() = default;
  /// One frame, in ascending order; a frame for each actor. Errors: kOutput, kInput.
  virtual Status add(int frame, std::span<const SurfaceFrame> frames) = 0;
  /// Writes the file, whole or not at all. Errors: kOutput, kInput.
  virtual Status finish() = 0;
};

/// OpenUSD as text (.usda): a Mesh for each actor, whose points, faces, normals, velocities (units
/// a second), primvars displayColor, st and label change with time; its materials; the camera.
/// Textures are PNG files beside it, "NAME.texture1.png", which replace others only with
/// `overwrite`. What the frames hold waits on the disk, so memory does not grow with their number.
Result<std::unique_ptr<SurfaceWriter>> make_usd_writer(const std::filesystem::path& path,
                                                       const SurfaceSequence& sequence,
                                                       bool overwrite);

struct GlbSettings {
  /// Positions in 16 bits over the box of actor and frame, normals in 8, colours in 16, texture
  /// coordinates in 16 where they lie in [0, 1] (KHR_mesh_quantization); no velocities.
  bool quantize = false;
};

/// Binary glTF 2.0: a node for each actor and frame, of which an animation shows one after the
/// other: by a scale of 0 and 1 that steps, which every viewer plays, and by KHR_node_visibility
/// with KHR_animation_pointer for those that know it. Frames that are alike share a node. Materials
/// and textures are in the file; so is _VELOCITY (units a second).
Result<std::unique_ptr<SurfaceWriter>> make_glb_writer(const std::filesystem::path& path,
                                                       const SurfaceSequence& sequence,
                                                       const GlbSettings& settings);

}  // namespace polymorph
