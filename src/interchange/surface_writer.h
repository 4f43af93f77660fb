// Writers of a sequence of surfaces into one file, frame by frame.
#pragma once

#include <filesystem>
#include <memory>
#include <span>

#include "base/result.h"
#include "interchange/surface_frame.h"

namespace polymorph {

/// Writer of one file. Call add() for each frame, then finish() once.
class SurfaceWriter {
 public:
  virtual ~SurfaceWriter() = default;
  /// Adds a frame, in ascending order of `frame`, with one surface per actor. Errors: kOutput if
  /// writing fails.
  virtual Status add(int frame, std::span<const SurfaceFrame> frames) = 0;
  /// Writes the file atomically. Errors: kOutput if writing fails or a file is in the way, kInput
  /// if a texture has no colours.
  virtual Status finish() = 0;
};

/// Makes a writer of OpenUSD text (.usda). The file contains the materials, the camera, and a Mesh
/// for each set of materials that an actor shows. Points, faces, normals, velocities (units per
/// second) and the primvars displayColor, st and label of a Mesh change with time. Textures are PNG
/// files in the same folder, "NAME.texture1.png". Existing ones are replaced only with `overwrite`.
/// Frames are stored on disk, so memory does not grow with their number. Errors: kOutput.
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
/// share a node. An animation shows the nodes in turn. It hides a node by a scale of 0, which every
/// viewer plays, and by KHR_node_visibility with KHR_animation_pointer. The attribute
/// _VELOCITY has units per second. With a constant topology, there is one node per actor with a
/// morph target per frame after the first, and no _VELOCITY. The file includes materials and
/// textures. Errors: kOutput.
Result<std::unique_ptr<SurfaceWriter>> make_glb_writer(const std::filesystem::path& path,
                                                       const SurfaceSequence& sequence,
                                                       const GlbSettings& settings);

}  // namespace polymorph
