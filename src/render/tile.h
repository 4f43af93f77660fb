// Tile rendering: from camera rays to a tile of the film, with adaptive sampling.
#pragma once

#include <span>
#include <vector>

#include "image/image.h"
#include "render/aov.h"
#include "render/film/camera_rays.h"
#include "render/film/convergence.h"
#include "render/film/cryptomatte.h"
#include "render/film/film.h"
#include "render/film/pixel_sum.h"
#include "render/math/sampler.h"
#include "render/path/integrator.h"
#include "render/render.h"
#include "render/sample_range.h"

namespace polymorph {

/// Sums and hits that a GPU has found for the pixels of a frame. The pixels are in rows from the
/// upper left. The spans are borrowed.
struct DeviceFilm {
  std::vector<BlockSpan> nodes;  ///< nodes that sum the frame's samples (list_nodes())
  /// One sum per pixel and node; the node's index runs fastest. A pixel that has converged early
  /// has fewer samples, and no samples in the remaining sums.
  std::span<const PixelSum> sums;
  /// Hits of the rays through pixels' centres; empty if neither AOVs nor
  /// FrameJob::needs_motion_test() need them.
  std::span<const MeshHit> centers;
};

/// Data that all tiles of a frame share.
struct FrameJob {
  World world;
  CameraSetup camera;
  Camera next_camera;        ///< camera of the next frame
  bool meshes_move = false;  ///< whether any mesh moves
  ImageSettings image;
  FrameSampler sampler;
  /// If true, the only sample of each pixel goes through its centre, and the film has AOVs.
  bool samples_centers = false;
  std::vector<const Aov*> aovs;    ///< AOV channels of the film, in order
  const Mattes* mattes = nullptr;  ///< not null; has no layers if the picture has no mattes
  SampleRange samples;             ///< samples to take
  int first_aov = 4;  ///< index of the first AOV's channel in the film; 4 follows R G B A
  /// MatteSums::sums if the film gets only a part of the frame's samples, else null.
  std::vector<MattePixel>* part_mattes = nullptr;
  /// Results of a GPU that has traced the samples, or null.
  const DeviceFilm* device_film = nullptr;

  /// Tests whether each pixel's samples depend on whether it shows motion (steady noise,
  /// sampler.h).
  bool needs_motion_test() const { return image.steady && meshes_move && !camera.moves; }
};

/// Tests whether the picture has mattes (film/cryptomatte.h) or guides (film/denoise.h). They come
/// from the first hits of the samples' camera rays, which the CPU finds even if a GPU traces the
/// samples.
inline bool needs_first_hits(const FrameJob& job) {
  return job.mattes->layer_count() > 0 || job.image.denoise;
}

/// Renders the tile in column `tile_x` and row `tile_y` into the film. A tile has kTile x kTile
/// pixels, or fewer at the right and lower edge. One task owns a tile and works through it in a
/// fixed order, so the picture does not depend on the threads. Adds the counts to `stats`.
void render_tile(const FrameJob& job, int tile_x, int tile_y, Image& film, RayStats& stats);

}  // namespace polymorph
