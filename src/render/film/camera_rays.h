// Camera rays from random numbers, for one ray or for eight.
#pragma once

#include "render/film/film.h"
#include "render/math/sampler.h"
#include "render/math/vector_math.h"
#include "render/rays/ray.h"
#include "render/render.h"

namespace polymorph {

/// Set of random numbers (PathSamplerOf::get()) of the ray's time. It differs from all sets of path
/// vertices (VertexRandomOf in path/scatter.h).
inline constexpr std::uint32_t kTimeSet = 4096;

/// Size of the whole picture in pixels.
struct FilmSize {
  int width = 0, height = 0;
};

/// Position, axes and lens of a camera, or of one camera per lane.
template <class T3>
struct CamerasOf {
  T3 position, right, up, forward;
  ComponentOf<T3> tan_half_fov_y, lens_radius, focus;
};
template <class T3>
PM_HD CamerasOf<T3> broadcast_camera(const Camera& camera) {
  return {broadcast3<T3>(camera.position),
          broadcast3<T3>(camera.right),
          broadcast3<T3>(camera.up),
          broadcast3<T3>(camera.forward),
          broadcast<ComponentOf<T3>>(camera.tan_half_fov_y),
          broadcast<ComponentOf<T3>>(camera.lens_radius),
          broadcast<ComponentOf<T3>>(camera.focus)};
}
/// Interpolates cameras at times while the shutter is open, [0, 1].
template <class T3>
PM_HD CamerasOf<T3> interpolate_cameras(const Camera& opening, const Camera& closing,
                                        ComponentOf<T3> time) {
  const auto lerp_vectors = [&](Vec3 from, Vec3 to) {
    return broadcast3<T3>(from) + broadcast3<T3>(to - from) * time;
  };
  const auto lerp_numbers = [&](float from, float to) { return from + time * (to - from); };
  return {lerp_vectors(opening.position, closing.position),
          normalized(lerp_vectors(opening.right, closing.right)),
          normalized(lerp_vectors(opening.up, closing.up)),
          normalized(lerp_vectors(opening.forward, closing.forward)),
          lerp_numbers(opening.tan_half_fov_y, closing.tan_half_fov_y),
          lerp_numbers(opening.lens_radius, closing.lens_radius),
          lerp_numbers(opening.focus, closing.focus)};
}

/// Makes rays through points of the film and of the lens. `film`: pixels from the image's upper
/// left corner; pixels are square. `lens`: random numbers in [0, 1)^2, unused if `pinhole`.
template <class T3>
PM_HD RayOf<T3> camera_rays(const CamerasOf<T3>& camera, FilmSize image,
                            Vec2Of<ComponentOf<T3>> film, Vec2Of<ComponentOf<T3>> lens,
                            bool pinhole) {
  using V = ComponentOf<T3>;
  const V scale = 2.0f * camera.tan_half_fov_y / static_cast<float>(image.height);
  const V right = (film.x - 0.5f * static_cast<float>(image.width)) * scale;
  const V up = (0.5f * static_cast<float>(image.height) - film.y) * scale;
  const T3 direction = camera.forward + camera.right * right + camera.up * up;
  if (pinhole) return {camera.position, normalized(direction)};
  const Vec2Of<V> offset = concentric_disc(lens.x, lens.y) * camera.lens_radius;
  const T3 shift = camera.right * offset.x + camera.up * offset.y;
  return {camera.position + shift, normalized(direction * camera.focus - shift)};
}

/// Camera and film of a frame. With a sampler they determine the rays of its samples.
struct CameraSetup {
  Camera camera;            ///< camera at the frame's time
  bool moves = false;       ///< whether the camera moves (RenderScene::camera_motion)
  Camera opening, closing;  ///< cameras when the shutter opens and closes, if the camera moves
  FilmSize size;
  const PixelFilter* filter = nullptr;  ///< borrowed
};

/// Makes the rays of samples in the pixels (x, y).
template <class T3>
PM_HD RayOf<T3> sample_camera_rays(const CameraSetup& setup,
                                   const PathSamplerOf<ComponentOf<T3>>& sampler, ComponentOf<T3> x,
                                   ComponentOf<T3> y) {
  using V = ComponentOf<T3>;
  const Sample4Of<V> random = sampler.get(0);
  const bool blurred = setup.camera.shutter > 0;
  const V time = blurred ? sampler.get(kTimeSet).a : broadcast<V>(0.5f);
  const CamerasOf<T3> cameras = blurred && setup.moves
                                    ? interpolate_cameras<T3>(setup.opening, setup.closing, time)
                                    : broadcast_camera<T3>(setup.camera);
  RayOf<T3> rays = camera_rays(cameras, setup.size,
                               {x + 0.5f + filter_offset(*setup.filter, random.a),
                                y + 0.5f + filter_offset(*setup.filter, random.b)},
                               {random.c, random.d}, !(setup.camera.lens_radius > 0));
  rays.time = time;
  return rays;
}

/// Makes the rays through the centres of the pixels (x, y).
template <class T3>
PM_HD RayOf<T3> center_rays(const CameraSetup& setup, ComponentOf<T3> x, ComponentOf<T3> y) {
  return camera_rays(broadcast_camera<T3>(setup.camera), setup.size, {x + 0.5f, y + 0.5f},
                     /*lens=*/Vec2Of<ComponentOf<T3>>{}, /*pinhole=*/true);
}

}  // namespace polymorph
