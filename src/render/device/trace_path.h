// Path tracing in a GPU's thread: the loop of integrator.cpp for a single path, with the same
// functions in the same order, so that the light has the same bits. Their masks of lanes are `true`
// here, for the only path.
#pragma once

#include "render/device/device_frame.h"
#include "render/path/scatter.h"

namespace polymorph {

/// Counterpart of ShadowRays that traces each ray immediately and adds the unoccluded light to
/// `direct`.
struct ShadowRay {
  const World& world;
  const DeviceScene& scene;
  RayStats& stats;
  Vec3 direct{};

  /// Omits rays that the floor occludes or that carry no light, as ShadowRays::add() does.
  PM_HD_CALL void add(const Ray& ray, Vec3 light, std::uint32_t /*path*/, bool live) {
    if (!live || !(intersect_floor(world.floor, ray) == kInfinity) || is_black(light)) return;
    if (world.has_glass) {
      direct = direct + light * trace_transmittance(world, scene, ray, stats);
      return;
    }
    ++stats.rays;
    if (!scene.is_occluded(ray)) direct = direct + light;
  }
};

/// Traces the final ray of a path at the depth limit, which only tests whether it sees the sky. The
/// floor counts as the sky's lower half.
PM_HD inline void trace_final_ray(const World& world, const DeviceScene& scene, PathRow& path,
                                  RayStats& stats) {
  Vec3 transmittance{1, 1, 1};
  if (world.has_glass) {
    transmittance = trace_transmittance(world, scene, path.ray, stats);
  } else {
    ++stats.rays;
    if (scene.is_occluded(path.ray)) transmittance = {};
  }
  // With a single bounce, an occluding surface reflects a fraction of the sky (kGuessedBounce).
  if (is_black(transmittance))
    return add_sky(world, path, world.max_depth == 1 ? kGuessedBounce : 0.0f, true);
  // For unoccluded rays the control variate is exact.
  if (min_component(transmittance) < 1.0f) add_sky(world, path, 0.0f, true);
  path.throughput = path.throughput * transmittance;
  leave_scene(world, path, true);
}

/// Traces the light along a camera ray. Each round of the loop ends in a hit on a mesh, a hit on
/// the floor, or the sky.
PM_HD inline PathLight trace_path(const DeviceFrame& frame, const Ray& ray, SampleIndex sample,
                                  RayStats& stats) {
  const World& world = frame.world;
  const DeviceScene& scene = frame.scene;
  ++stats.paths;
  ShadowRay shadows{world, scene, stats};
  PathRow path;
  path.ray = ray;
  path.ray.far = kInfinity;
  path.depth_left = static_cast<float>(world.max_depth);
  path.sample = sample.reversed;
  for (std::uint32_t depth = 1;; ++depth) {
    if (!(path.depth_left > 0)) {
      trace_final_ray(world, scene, path, stats);
      break;
    }
    ++stats.rays;
    Ray shortened = path.ray;
    const float floor = intersect_floor(world.floor, path.ray);
    shortened.far = min(floor, path.ray.far);
    const MeshHit hit = scene.closest(shortened);
    const VertexRandomOf<float> random{
        {frame.sampler, sample.sequence, sample.reversed}, depth, world.direct_only};
    VerticesOf<Vec3, ShadowRay> vertex{path,          /*rows=*/0,      /*origin=*/{},
                                       /*live=*/true, /*uses_mis=*/{}, shadows};
    if (hit.mesh != kNoMesh) {
      add_hit_lamps(world, path, hit.distance, true);
      add_sky(world, path, 0.0f, true);
      const DeviceMesh& mesh = scene.mesh(hit.mesh);
      const SurfacePoint point = scene.surface_point(path.ray, hit);
      if (world.has_glass) {
        const Sample4 numbers = random.glass();
        const Shading shading = mixed_shading(world, mesh, hit);
        if (shading.transmission > numbers.b) {
          if (path.flags >> kGlassShift == 0) {
            // A path that has passed the maximum number of boundaries sees the sky along its ray.
            add_sky(world, path, 1.0f, true);
            break;
          }
          path.flags -= 1u << kGlassShift;
          pass_glass(world, path, point, shading, numbers);
          continue;
        }
      }
      const Bsdf bsdf =
          make_bsdf_at(world, mesh, hit, point.shading, -path.ray.direction, has(path, kScattered));
      if (!scatter_on_mesh(world, vertex, point, bsdf, random)) break;
    } else if (floor < kInfinity) {
      add_hit_lamps(world, path, floor, true);
      const FloorPointOf<Vec3> point = floor_point(world.floor, path.ray, floor);
      add_sky(world, path, point.fade, true);
      path.throughput = path.throughput * (1.0f - point.fade);
      const bool continues = scatter_on_floor(world, vertex, point, random, stats);
      path.depth_left = path.depth_left - 1.0f;
      if (!continues) break;
    } else {
      leave_scene(world, path, true);
      break;
    }
  }
  return make_result(path, shadows.direct);
}

/// Finds the mesh that the ray through a pixel's centre hits before the floor.
PM_HD inline MeshHit find_center(const DeviceFrame& frame, int x, int y, RayStats& stats) {
  Ray ray = center_rays<Vec3>(frame.camera, static_cast<float>(x), static_cast<float>(y));
  ray.far = min(intersect_floor(frame.world.floor, ray), ray.far);
  ++stats.rays;
  return frame.scene.closest(ray);
}

/// Tests whether a pixel counts as moving (sample_index()). `center`: hit at the pixel's centre.
PM_HD inline bool shows_motion(const DeviceFrame& frame, const MeshHit& center) {
  if (!frame.needs_motion_test) return frame.camera.moves;
  return center.mesh != kNoMesh && frame.scene.mesh(center.mesh).moves;
}

/// Traces one sample of a pixel.
PM_HD inline PathLight trace_sample(const DeviceFrame& frame, int x, int y, std::uint32_t sample,
                                    bool moving, RayStats& stats) {
  const SampleIndex index = sample_index(frame.sampler, x, y, sample, moving);
  const PathSamplerOf<float> sampler(frame.sampler, index.sequence, index.reversed);
  const Ray ray =
      sample_camera_rays<Vec3>(frame.camera, sampler, static_cast<float>(x), static_cast<float>(y));
  return trace_path(frame, ray, index, stats);
}

/// Sums the light of the samples [first, end) of a pixel into their nodes, as SampleSums does.
/// `continues`: on entry nodes[0] is the sum of all samples before `first`.
PM_HD inline void sum_samples(const PathLight* path_lights, int first, int end, bool continues,
                              PixelSum* nodes) {
  // A range has at most 2^12 blocks (kMaxSamples). Its nodes have 13 sizes, at most two nodes each.
  constexpr int kMaxNodes = 26;
  BlockSpan spans[kMaxNodes];
  PixelSum sums[kMaxNodes];
  int count = 0;
  if (continues) {
    spans[0] = {0, first / kSampleBlock};
    sums[0] = nodes[0];
    count = 1;
  }
  for (int start = first; start < end; start += kSampleBlock) {
    PixelSum sum;
    for (int s = start; s < end && s < start + kSampleBlock; ++s)
      add_sample(sum, *path_lights++, s % 2 == 1);
    BlockSpan span{start / kSampleBlock, 1};
    // Merges the node with its sibling, the result with its sibling, and so on.
    for (; count > 0 && are_siblings(spans[count - 1], span); --count) {
      sums[count - 1].add(sum);
      sum = sums[count - 1];
      span = {spans[count - 1].first, 2 * span.count};
    }
    spans[count] = span;
    sums[count++] = sum;
  }
  for (int i = 0; i < count; ++i) nodes[i] = sums[i];
}

/// Returns the number of tiles of the picture.
PM_HD inline int count_tiles(const DeviceFrame& frame) {
  const auto tiles = [](int pixels) { return (pixels + kTile - 1) / kTile; };
  return tiles(frame.camera.size.width) * tiles(frame.camera.size.height);
}

/// Marks the converged pixels of a tile as done; returns whether any pixels of it are left. `sums`
/// and `done` are arrays of the whole picture.
PM_HD inline bool mark_tile(const DeviceFrame& frame, int tile, const PixelSum* sums, bool* done) {
  const int width = frame.camera.size.width, height = frame.camera.size.height;
  const int columns = (width + kTile - 1) / kTile;
  const int left = tile % columns * kTile, top = tile / columns * kTile;
  const auto pixel = [&](int x, int y) {
    return static_cast<std::size_t>(top + y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(left + x);
  };
  const auto tile_size = [](int remaining) { return remaining < kTile ? remaining : kTile; };
  return mark_converged(
      tile_size(width - left), tile_size(height - top), frame.noise,
      [&](int x, int y) { return sums[pixel(x, y) * static_cast<std::size_t>(frame.node_count)]; },
      [&](int x, int y) -> bool& { return done[pixel(x, y)]; });
}

}  // namespace polymorph
