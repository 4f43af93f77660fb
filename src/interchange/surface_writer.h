// Writers of a sequence of surfaces into one file, frame by frame.
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
  /// Adds a frame, in ascending order of `frame`, with one surface per actor. Errors: kOutput,
  /// kInput.
  virtual Status add(int frame, std::span<const SurfaceFrame> frames) = 0;
  /// Writes the file atomically. Errors: kOutput, kInput.
  virtual Status finish() = 0;
};

/// Makes a writer of OpenUSD text (.usda). It contains a Mesh for each set of materials that an
/// actor shows, whose points, faces, normals, velocities (units per second) and primvars
/// displayColor, st and label change with time; the materials; the camera. Textures are PNG files
/// in the same folder, "NAME.texture1.png". Existing ones are replaced only with `overwrite`.
/// Frames are stored on disk, so memory does not grow with their number.
Result<std::unique_ptr<SurfaceWriter>> make_usd_writer(const std::filesystem::path& path,
                                                       const SurfaceSequence& sequence,
                                                       bool overwrite);

struct GlbSettings {
  /// Quantizes positions to 16 bits over the box of actor and frame, normals to 8 bits, colours to
  /// 16 bits, and texture coordinates in [0, 1] to 16 bits (KHR_mesh_quantization). Omits
  /// velocities.
  bool quantize = false;
};

/// Makes a writer of binary glTF 2.0 with a node per actor and frame; equal consecutive frames
/// share a node. An animation shows the nodes in turn by a scale that is 0 for hidden ones, which
/// every viewer plays, and by KHR_node_visibility with KHR_animation_pointer. The attribute
/// _VELOCITY has units per second. With a constant topology, there is one node per actor with a
/// morph target per frame after the first, and no _VELOCITY. Includes materials and textures.
Result<std::unique_ptr<SurfaceWriter>> make_glb_writer(const std::filesystem::path& path,
                                                       const SurfaceSequence& sequence,
                                                       const GlbSettings& settings);

}  // namespace polymorph
