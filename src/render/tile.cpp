#include "render/tile.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/floating_point.h"

namespace polymorph {
namespace {

constexpr int kPixels = kTile * kTile;
constexpr int kFirstSamples = 16;         // of the adaptive rounds; each round doubles them
constexpr int kBlock = 4;                 // pixels along a side of what goes on or stops together
constexpr std::uint32_t kTimeSet = 4096;  // beside the sets of the vertices

/// Rays through (x, y), in pixels from the picture's upper left corner, and through the points
/// (u, v) of the lens. Pixels are square.
RayOf<Pack3> camera_rays(const Camera& camera, const ImageSettings& image, Pack x, Pack y,
                         Vec2Of<Pack> lens) {
  const float scale = 2 * camera.tan_half_fov_y / static_cast<float>(image.height);
  const Pack across = (x - 0.5f * static_cast<float>(image.width)) * scale;
  const Pack upward = (0.5f * static_cast<float>(image.height) - y) * scale;
  const Pack3 way = camera.forward + camera.right * across + camera.up * upward;
  if (!(camera.lens_radius > 0)) return {broadcast3<Pack3>(camera.position), normalized(way)};
  const Pack2 at = concentric_disc(lens.x, lens.y) * broadcast<Pack>(camera.lens_radius);
  const Pack3 shift = camera.right * at.x + camera.up * at.y;
  return {camera.position + shift, normalized(way * camera.focus - shift)};
}

/// What the samples of a pixel add up to.
struct PixelSum {
  Vec3 light, odd;  ///< of all samples, of every second one
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
        height_(std::min(kTile, job.image.height - top_)) {}

  void sample() {
    const int most = job_.image.samples;
    if (!(job_.image.noise > 0)) return sample_round(0, most);
    for (int from = 0, to = std::min(kFirstSamples, most); from < most;
         from = to, to = std::min(2 * to, most)) {
      sample_round(from, to);
      if (to < most && !keep_noisy()) return;
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

  void write_aovs(Image& film) {
    Camera pinhole = job_.camera;
    pinhole.lens_radius = 0;
    for (int y = 0; y < height_; ++y) {
      RayOf<Pack3> rays[2];
      IntersectionOf<Pack> intersections[2];
      for (int k = 0; k < 2; ++k)
        rays[k] = camera_rays(pinhole, job_.image,
                              Lanes<Pack>::iota() + (static_cast<float>(left_ + k * kLanes) + 0.5f),
                              broadcast<Pack>(static_cast<float>(top_ + y) + 0.5f), Pack2{});
      intersect_closest(job_.world, rays, intersections, width_, true, stats_);
      for (int x = 0; x < width_; ++x) {
        const Ray ray = lane(rays[x / kLanes], x % kLanes);
        FirstHit hit = first_hit(job_.world, ray, lane(intersections[x / kLanes], x % kLanes));
        if (hit.id > 0) hit.depth *= dot(ray.direction, job_.camera.forward);
        if (hit.id > 1) {
          const Vec2 now = on_film(hit.position), next = on_film(hit.next);
          hit.motion = {next.x - now.x, next.y - now.y};
        }
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
    trace(job_.world, job_.sampler, wave_, stats_);
    for (int i = 0; i < wave_.count; ++i)
      add_sample(sums_[pixels_[i]], wave_.lights[i], numbers_[i] % 2 == 1);
    wave_.count = 0;
  }

  /// Camera rays of the samples [first, first + 8).
  void shoot(int first) {
    const int end = std::min(first + kLanes, wave_.count);
    Pack x{}, y{};
    PackBits index{};
    for (int i = first; i < end; ++i) {
      const int column = left_ + pixels_[i] % width_, row = top_ + pixels_[i] / width_;
      const SampleIndex sample = sample_index(job_.sampler, column, row, numbers_[i]);
      x[i - first] = static_cast<float>(column) + 0.5f;
      y[i - first] = static_cast<float>(row) + 0.5f;
      index[i - first] = wave_.samples[i] = sample.reversed;
      wave_.sequence = sample.sequence;
    }
    const PathSamplerOf<Pack> sampler(job_.sampler, wave_.sequence, index);
    const Sample4Of<Pack> random = sampler.get(0);
    RayOf<Pack3> rays =
        camera_rays(job_.camera, job_.image, x + filter_offset(*job_.filter, random.a),
                    y + filter_offset(*job_.filter, random.b), {random.c, random.d});
    if (job_.camera.shutter > 0) rays.time = sampler.get(kTimeSet).a;
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

  Vec2 on_film(Vec3 point) const {
    const Vec3 way = point - job_.camera.position;
    const float scale =
        static_cast<float>(job_.image.height) /
        (2 * job_.camera.tan_half_fov_y * std::max(dot(way, job_.camera.forward), 1e-6f));
    return {dot(way, job_.camera.right) * scale, -dot(way, job_.camera.up) * scale};
  }

  const FrameJob& job_;
  RayStats& stats_;
  const int left_, top_, width_, height_;
  std::array<PixelSum, kPixels> sums_{};
  std::array<bool, kPixels> done_{};
  Wavefront wave_;
  std::array<int, Wavefront::kMax> pixels_;             ///< of each path of the wave
  std::array<std::uint32_t, Wavefront::kMax> numbers_;  ///< which of the pixel's samples it is
};

}  // namespace

void render_tile(const FrameJob& job, int tile_x, int tile_y, Image& film, RayStats& stats) {
  const FlushDenormals flush;
  Tile tile(job, tile_x, tile_y, stats);
  tile.sample();
  tile.write(film);
  if (!job.aovs.empty()) tile.write_aovs(film);
}

}  // namespace polymorph
