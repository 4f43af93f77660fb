// Frame data for a GPU, whose arrays lie in one block of memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "render/device/device_scene.h"
#include "render/tile.h"

namespace polymorph {

/// A frame to trace. Its pointers refer to the block of memory (pack_frame()).
struct DeviceFrame {
  World world;
  DeviceScene scene;
  CameraSetup camera;
  FrameSampler sampler;
  /// Samples [first, end) to trace: all of them, or those of one round (round_end()).
  int first_sample = 0, end_sample = 0;
  int node_count = 0;              ///< number of nodes that sum the frame's samples (list_nodes())
  bool finds_centers = false;      ///< whether the rays through pixels' centres are traced
  bool needs_motion_test = false;  ///< FrameJob::needs_motion_test()
  float noise = 0;                 ///< ImageSettings::noise: above 0 pixels stop when they converge
};

/// Bytes of device memory per triangle for the hierarchy and its construction.
inline constexpr std::size_t kHierarchyBytes = 192;

/// Names a feature of the frame that a GPU does not trace, for the log; empty if there is none.
std::string find_device_obstacle(const FrameJob& job);

/// Buffers of a device that traces a frame some rows at a time.
struct DeviceBuffers {
  std::size_t rows = 0;     ///< rows of one launch
  std::size_t samples = 0;  ///< samples of a pixel in the longest round (round_end())
  std::string error;        ///< why not even one row fits, for the log; else empty
};

/// Chooses the rows of a launch. They have at most 4 million paths (unless a single row has more).
/// They fit into `max_memory` bytes (0: no limit), together with the packed frame of `frame_bytes`,
/// the hierarchy and the film.
DeviceBuffers size_buffers(const FrameJob& job, const DeviceFrame& frame, std::size_t frame_bytes,
                           std::size_t max_memory);

/// Packs a frame for memory that begins at `address`, and returns its size in bytes. Writes the
/// contents of that memory to `bytes`; with null, only the size counts. `frame` then refers to
/// memory at `address`; its scene does not yet have a hierarchy.
std::size_t pack_frame(const FrameJob& job, const void* address, std::byte* bytes,
                       DeviceFrame& frame);

}  // namespace polymorph
