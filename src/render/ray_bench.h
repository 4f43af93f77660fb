// Ray tracing benchmark: rays per second of plain Embree loops and of the renderer's own queries,
// on one mesh.
#pragma once

#include <vector>

#include "render/render.h"

namespace polymorph {

class DeviceTracer;

/// One benchmark loop: its number of rays, and the seconds of each run.
struct RayLoop {
  const char* name;
  std::size_t rays = 0;
  std::vector<double> seconds;
};

/// Runs every loop `repeats` times, alternating, so that noise of the machine affects all: plain
/// camera rays one by one and in packets of 16, the renderer's camera rays, plain rays that leave
/// the surface in random directions, and the same rays in the renderer. `scene` has one mesh.
/// Errors: kResource.
Result<std::vector<RayLoop>> measure_rays(const RenderScene& scene, int width, int height,
                                          int repeats);

/// Runs camera rays and rays that leave the surface on a GPU in the same way, each as `tracer`
/// decides them and in floats, on the same hierarchy: bare ones, the tracer's. Errors: kResource.
Result<std::vector<RayLoop>> measure_device_rays(const RenderScene& scene, DeviceTracer& tracer,
                                                 int width, int height, int repeats);

/// Seconds to build the BVH of the scene's mesh at one of Embree's qualities, and to trace a
/// million random rays.
struct BuildQuality {
  const char* name;
  double build_seconds = 0, trace_seconds = 0;
};
Result<std::vector<BuildQuality>> measure_builds(const RenderScene& scene);

}  // namespace polymorph
