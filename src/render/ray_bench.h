// Ray tracing benchmark: rays per second of plain Embree loops and of the renderer's own queries,
// on one mesh.
#pragma once

#include <vector>

#include "render/render.h"

namespace polymorph {

class DeviceTracer;

/// One benchmark loop.
struct RayLoop {
  const char* name;
  std::size_t rays = 0;         ///< rays of one run
  std::vector<double> seconds;  ///< per run
};

/// Runs every loop `repeats` times after a warm-up run. The loops take turns, so that noise of the
/// machine affects all alike. They are: camera rays in plain Embree singly and in packets of 16,
/// camera rays in the renderer, and rays that leave the surface in random directions in plain
/// Embree and in the renderer. `scene` must have one mesh. Errors: kResource.
Result<std::vector<RayLoop>> measure_rays(const RenderScene& scene, int width, int height,
                                          int repeats);

/// Measures camera rays and rays that leave the surface on a GPU in the same way: first with a
/// plain test in floats ("bare"), then with the exact test of `tracer`, on the same hierarchy.
/// Errors: kResource.
Result<std::vector<RayLoop>> measure_device_rays(const RenderScene& scene, DeviceTracer& tracer,
                                                 int width, int height, int repeats);

/// Cost of one of Embree's build qualities: seconds to build the BVH of the scene's mesh, and to
/// trace a million rays that leave the mesh in random directions.
struct BuildQuality {
  const char* name;  ///< "low", "medium" or "high"
  double build_seconds = 0, trace_seconds = 0;
};
Result<std::vector<BuildQuality>> measure_builds(const RenderScene& scene);

}  // namespace polymorph
