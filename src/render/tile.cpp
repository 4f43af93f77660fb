#include "render/tile.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/floating_point.h"
#include "render/film/denoise.h"

namespace polymorph {
namespace {

constexpr int kPixels = kTile * kTile;
constexpr int kFirstSamples = 16;         // of the adaptive rounds; each round doubles them
constexpr int kBlock = 4;                 // pixels along a side of what goes on or stops together
constexpr std::uint32_t kTimeSet = 4096;  // beside the sets of the vertices

/// A camera of each lane.
struct Cameras {
  Pack3 position, right, up, forward;
  Pack tan_half_fov_y, lens_radius, focus;
};
Cameras cameras_of(const Camera& camera) {
  return {broadcast3<Pack3>(camera.position),     broadcast3<Pack3>(camera.right),
          broadcast3<Pack3>(camera.up),           broadcast3<Pack3>(camera.forward),
          broadcast<Pack>(camera.tan_half_fov_y), broadcast<Pack>(camera.lens_radius),
          broadcast<Pack>(camera.focus)};
}
/// At times of the shutter's, in [0, 1].
Cameras cameras_between(const Camera& opening, const Camera& closing, Pack time) {
  const auto between = [&](Vec3 from, Vec3 to) {
    return broadcast3<Pack3>(from) + broadcast3<Pack3>(to - from) * time;
  };
  const auto at = [&](float from, float to) { return from + time * (to - from); };
  return {between(opening.position, closing.position),
          normalized(between(opening.right, closing.right)),
          normalized(between(opening.up, closing.up)),
          normalized(between(opening.forward, closing.forward)),
          at(opening.tan_half_fov_y, closing.tan_half_fov_y),
          at(opening.lens_radius, closing.lens_radius),
          at(opening.focus, closing.focus)};
}

/// Rays through (x, y), in pixels from the picture's upper left corner, and through the points
/// (u, v) of the lens. Pixels are square.
RayOf<Pack3> camera_rays(const Cameras& camera, const ImageSettings& image, Pack x, Pack y,
                         Vec2Of<Pack> lens, bool pinhole) {
  const Pack scale = 2.0f * camera.tan_half_fov_y / static_cast<float>(image.height);
  const Pack across = (x - 0.5f * static_cast<float>(image.width)) * scale;
  const Pack upward = (0.5f * static_cast<float>(image.height) - y) * scale;
  const Pack3 way = camera.forward + camera.right * across + camera.up * upward;
  if (pinhole) return {camera.position, normalized(way)};
  const Pack2 at = concentric_disc(lens.x, lens.y) * camera.lens_radius;
  const Pack3 shift = camera.right * at.x + camera.up * at.y;
  return {camera.position + shift, normalized(way * camera.focus - shift)};
}

/// Where a camera shows what lies that way: pixels from the picture's middle, x right, y down.
Vec2 on_film(const Camera& camera, const ImageSettings& image, Vec3 way) {
  const float scale = static_cast<float>(image.height) /
                      (2 * camera.tan_half_fov_y * std::max(dot(way, camera.forward), 1e-6f));
  return {dot(way, camera.right) * scale, -dot(way, camera.up) * scale};
}

/// What the samples of a pixel add up to.
struct PixelSum {
  Vec3 light, odd;      ///< of all samples, of every second one
  Vec3 albedo, normal;  ///< guides of the denoiser
  float alpha = 0, floor = 0, lit = 0, unlit = 0;
  int samples = 0;
};

void add_sample(PixelSum& sum, const PathLight& light, bool odd) {
  ++sum.samples;
  sum.alpha += light.alpha;
  sum.floor += light.floor;
  sum.lit += light.lit;
  sum.unlit += light.unlit;
  // One bad normal or texel must not blacken a whole film's compositing.
  if (!finite(light.radiance)) return;
  sum.light = sum.light + light.radiance;
  if (odd) sum.odd = sum.odd + light.radiance;
}

/// Error of the mean, over the root of its brightness: what the eye makes of it, about (Dammertz et
/// al. 2010, "A hierarchical automatic stopping condition for Monte Carlo global illumination").
float error_of(const PixelSum& sum) {
  const float n = static_cast<float>(sum.samples);
  const Vec3 mean = sum.light / n, half = sum.odd * (2 / n);
  const Vec3 off = mean - half;
  return (std::fabs(off.x) + std::fabs(off.y) + std::fabs(off.z)) /
         (0.01f + std::sqrt(std::max(0.0f, mean.x + mean.y + mean.z)));
}

class Tile {
 public:
  Tile(const FrameJob& job, int tile_x, int tile_y, RayStats& stats)
      : job_(job),
        stats_(stats),
        left_(tile_x * kTile),
        top_(tile_y * kTile),
        width_(std::min(kTile, job.image.width - left_)),
        height_(std::min(kTile, job.image.height - top_)),
        mattes_(job.mattes->layer_count() * kPixels) {}

  void sample() {
    const int max_samples = job_.image.samples;
    if (!(job_.image.noise > 0)) return sample_round(0, max_samples);
    for (int from = 0, to = std::min(kFirstSamples, max_samples); from < max_samples;
         from = to, to = std::min(2 * to, max_samples)) {
      sample_round(from, to);
      if (to < max_samples && !keep_noisy()) return;
    }
  }

  void write(Image& film) {
    for (int i = 0; i < width_ * height_; ++i) {
      const PixelSum& sum = sums_[i];
      const float n = static_cast<float>(sum.samples);
      float* pixel = &film.at(left_ + i % width_, top_ + i / width_, 0);
      // The control variate may leave a pixel a trace below black.
      const Vec3 light = max(sum.light / n, Vec3{});
      const float shadow = sum.unlit > 0 ? 1 - sum.lit / sum.unlit : 0.0f;
      pixel[0] = light.x;
      pixel[1] = light.y;
      pixel[2] = light.z;
      // Samples' alphas are whole numbers where nothing is transparent: exactly 1.
      pixel[3] = clamp01((sum.alpha + sum.floor * clamp01(shadow)) / n);
    }
  }

  /// Finds what the rays through the pixels' centres hit, where somebody asks.
  void look() {
    const bool steady = job_.image.steady && !job_.camera_motion && job_.meshes_move;
    moving_.fill(job_.camera_motion.has_value());
    if (job_.aovs.empty() && !steady) return;
    const Cameras camera = cameras_of(job_.camera);
    for (int y = 0; y < height_; ++y) {
      CenterRow& row = centers_[y];
      for (int k = 0; k < 2; ++k)
        row.rays[k] =
            camera_rays(camera, job_.image,
                        Lanes<Pack>::iota() + (static_cast<float>(left_ + k * kLanes) + 0.5f),
                        broadcast<Pack>(static_cast<float>(top_ + y) + 0.5f), Pack2{}, true);
      intersect_closest(job_.world, row.rays, row.intersections, width_, true, stats_);
      if (!steady) continue;
      for (int x = 0; x < width_; ++x) {
        const std::uint32_t mesh = row.intersections[x / kLanes].mesh.mesh[x % kLanes];
        moving_[y * width_ + x] = mesh != kNoMesh && job_.world.geometry->mesh(mesh).moves;
      }
    }
  }

  void write_mattes(Image& film) {
    const std::size_t layers = job_.mattes->layer_count();
    for (int i = 0; i < width_ * height_; ++i) {
      float* pixel =
          &film.at(left_ + i % width_, top_ + i / width_, 4 + static_cast<int>(job_.aovs.size()));
      for (std::size_t layer = 0; layer < layers; ++layer) {
        const auto ranked = mattes_[static_cast<std::size_t>(i) * layers + layer].ranked(
            static_cast<float>(sums_[i].samples));
        pixel = std::copy(ranked.begin(), ranked.end(), pixel);
      }
    }
  }

  /// Into the last six channels.
  void write_guides(Image& film) {
    for (int i = 0; i < width_ * height_; ++i) {
      const float n = static_cast<float>(sums_[i].samples);
      const Vec3 albedo = sums_[i].albedo / n, normal = sums_[i].normal / n;
      float* pixel = &film.at(left_ + i % width_, top_ + i / width_,
                              static_cast<int>(film.channel_count()) - 6);
      for (const float value : {albedo.x, albedo.y, albedo.z, normal.x, normal.y, normal.z})
        *pixel++ = std::isfinite(value) ? value : 0;
    }
  }

  void write_aovs(Image& film) {
    for (int y = 0; y < height_; ++y) {
      const CenterRow& row = centers_[y];
      for (int x = 0; x < width_; ++x) {
        const Ray ray = lane(row.rays[x / kLanes], x % kLanes);
        FirstHit hit = first_hit(job_.world, ray, lane(row.intersections[x / kLanes], x % kLanes));
        if (hit.id > 0) hit.depth *= dot(ray.direction, job_.camera.forward);
        hit.motion = motion_of(hit, ray.direction);
        float* pixel = &film.at(left_ + x, top_ + y, 4);
        for (const Aov* aov : job_.aovs) *pixel++ = aov->value(hit);
      }
    }
  }

 private:
  /// Samples [from, to) of the pixels that are still noisy.
  void sample_round(int from, int to) {
    for (int pixel = 0; pixel < width_ * height_; ++pixel) {
      if (done_[pixel]) continue;
      for (int s = from; s < to; ++s) {
        pixels_[wave_.count] = pixel;
        numbers_[wave_.count] = static_cast<std::uint32_t>(s);
        if (++wave_.count == Wavefront::kMax) flush();
      }
    }
    if (wave_.count > 0) flush();
  }

  /// Follows the paths that have been collected.
  void flush() {
    for (int first = 0; first < wave_.count; first += kLanes) shoot(first);
    if (!mattes_.empty() || job_.image.denoise) look_at_samples();
    trace(job_.world, job_.sampler, wave_, stats_);
    for (int i = 0; i < wave_.count; ++i)
      add_sample(sums_[pixels_[i]], wave_.lights[i], numbers_[i] % 2 == 1);
    wave_.count = 0;
  }

  /// Mattes and guides, from what the wave's camera rays hit first. They are traced once more for
  /// it, which few pictures pay for.
  void look_at_samples() {
    for (int first = 0; first < wave_.count; first += kPacket) {
      const int count = std::min(kPacket, wave_.count - first);
      RayOf<Pack3> rays[kPacket / kLanes];
      IntersectionOf<Pack> intersections[kPacket / kLanes];
      for (int i = 0; i < kPacket; ++i) {
        const Ray& ray = wave_.rays[first + std::min(i, count - 1)];
        RayOf<Pack3>& pack = rays[i / kLanes];
        set_lane(pack.origin, i % kLanes, ray.origin);
        set_lane(pack.direction, i % kLanes, ray.direction);
        pack.time[i % kLanes] = ray.time;
      }
      intersect_closest(job_.world, rays, intersections, count, true, stats_);
      for (int i = 0; i < count; ++i)
        look_at_sample(pixels_[first + i], wave_.rays[first + i],
                       lane(intersections[i / kLanes], i % kLanes));
    }
  }
  void look_at_sample(int pixel, const Ray& ray, const Intersection& intersection) {
    if (!mattes_.empty())
      job_.mattes->add_sample(
          job_.world, ray, intersection,
          &mattes_[static_cast<std::size_t>(pixel) * job_.mattes->layer_count()]);
    if (!job_.image.denoise) return;
    const Guide guide = guide_of(job_.world, ray, intersection, stats_);
    sums_[pixel].albedo = sums_[pixel].albedo + guide.albedo;
    sums_[pixel].normal = sums_[pixel].normal + guide.normal;
  }

  /// Camera rays of the samples [first, first + 8).
  void shoot(int first) {
    const int end = std::min(first + kLanes, wave_.count);
    Pack x{}, y{};
    PackBits index{};
    for (int i = first; i < end; ++i) {
      const int column = left_ + pixels_[i] % width_, row = top_ + pixels_[i] / width_;
      const SampleIndex sample =
          sample_index(job_.sampler, column, row, numbers_[i], moving_[pixels_[i]]);
      x[i - first] = static_cast<float>(column) + 0.5f;
      y[i - first] = static_cast<float>(row) + 0.5f;
      index[i - first] = wave_.samples[i] = sample.reversed;
      wave_.sequence = sample.sequence;
    }
    const PathSamplerOf<Pack> sampler(job_.sampler, wave_.sequence, index);
    const Sample4Of<Pack> random = sampler.get(0);
    const bool blurred = job_.camera.shutter > 0;
    const Pack time = blurred ? sampler.get(kTimeSet).a : broadcast<Pack>(0.5f);
    const Cameras cameras =
        blurred && job_.camera_motion
            ? cameras_between(job_.camera_motion->opening, job_.camera_motion->closing, time)
            : cameras_of(job_.camera);
    RayOf<Pack3> rays = camera_rays(cameras, job_.image, x + filter_offset(*job_.filter, random.a),
                                    y + filter_offset(*job_.filter, random.b), {random.c, random.d},
                                    !(job_.camera.lens_radius > 0));
    rays.time = time;
    for (int i = first; i < end; ++i) wave_.rays[i] = lane(rays, i - first);
  }

  /// Marks the pixels of calm blocks as done; says whether any are left. A block beside a noisy one
  /// goes on with it: one block's own guess is unsure.
  bool keep_noisy() {
    const int columns = (width_ + kBlock - 1) / kBlock, rows = (height_ + kBlock - 1) / kBlock;
    std::array<bool, kPixels / (kBlock * kBlock)> noisy{};
    for (int b = 0; b < columns * rows; ++b) {
      float sum = 0;
      int count = 0;
      for_block(b, columns, [&](int pixel) {
        sum += error_of(sums_[pixel]);
        ++count;
      });
      noisy[b] = !(sum <= job_.image.noise * static_cast<float>(count));
    }
    bool any = false;
    for (int b = 0; b < columns * rows; ++b) {
      bool go_on = false;
      for (int c = 0; c < columns * rows; ++c)
        go_on = go_on || (noisy[c] && std::abs(b % columns - c % columns) <= 1 &&
                          std::abs(b / columns - c / columns) <= 1);
      any = any || go_on;
      // A pixel that has stopped stays so: its samples must be the sequence's first 2^k.
      if (!go_on) for_block(b, columns, [&](int pixel) { done_[pixel] = true; });
    }
    return any && std::find(done_.begin(), done_.begin() + width_ * height_, false) !=
                      done_.begin() + width_ * height_;
  }

  template <class F>
  void for_block(int block, int columns, const F& f) const {
    const int x0 = block % columns * kBlock, y0 = block / columns * kBlock;
    for (int y = y0; y < std::min(y0 + kBlock, height_); ++y)
      for (int x = x0; x < std::min(x0 + kBlock, width_); ++x) f(y * width_ + x);
  }

  /// Pixels to the next frame.
  Vec2 motion_of(const FirstHit& hit, Vec3 direction) const {
    const Camera &now = job_.camera,
                 &then = job_.camera_motion ? job_.camera_motion->next : job_.camera;
    // A sky is infinitely far away; the studio's paper goes with the camera.
    const bool sky = hit.id == 0 && job_.world.backdrop.sky;
    if (hit.id == 0 && !sky) return {};
    const Vec2 from = on_film(now, job_.image, sky ? direction : hit.position - now.position);
    const Vec2 to = on_film(then, job_.image, sky ? direction : hit.next - then.position);
    return {to.x - from.x, to.y - from.y};
  }

  const FrameJob& job_;
  RayStats& stats_;
  const int left_, top_, width_, height_;
  std::array<PixelSum, kPixels> sums_{};
  std::array<bool, kPixels> done_{};
  std::vector<MattePixel> mattes_;  ///< of each pixel one per layer
  /// Rays through the centres of a row's pixels.
  struct CenterRow {
    RayOf<Pack3> rays[kTile / kLanes];
    IntersectionOf<Pack> intersections[kTile / kLanes];
  };
  std::array<CenterRow, kTile> centers_;
  std::array<bool, kPixels> moving_{};  ///< the pixel shows something that moves
  Wavefront wave_;
  std::array<int, Wavefront::kMax> pixels_;             ///< of each path of the wave
  std::array<std::uint32_t, Wavefront::kMax> numbers_;  ///< which of the pixel's samples it is
};

}  // namespace

void render_tile(const FrameJob& job, int tile_x, int tile_y, Image& film, RayStats& stats) {
  const FlushDenormals flush;
  Tile tile(job, tile_x, tile_y, stats);
  tile.look();
  tile.sample();
  tile.write(film);
  if (!job.aovs.empty()) tile.write_aovs(film);
  if (job.mattes->layer_count() > 0) tile.write_mattes(film);
  if (job.image.denoise) tile.write_guides(film);
}

}  // namespace polymorph
