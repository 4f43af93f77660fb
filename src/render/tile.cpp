#include "render/tile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string_view>

#include "kernels/floating_point.h"
#include "kernels/interruption.h"
#include "render/film/camera_rays.h"
#include "render/film/convergence.h"
#include "render/film/denoise.h"
#include "render/film/part.h"
#include "render/film/pixel_sum.h"
#include "render/film/sample_sums.h"

namespace polymorph {
namespace {

constexpr int kPixels = kTile * kTile;  // of a whole tile

/// Projects a direction to the film: pixels from the image's centre, x right, y down. A direction
/// that does not point forward lands very far from the centre.
Vec2 project_to_film(const Camera& camera, const ImageSettings& image, Vec3 direction) {
  const float scale = static_cast<float>(image.height) /
                      (2 * camera.tan_half_fov_y * std::max(dot(direction, camera.forward), 1e-6f));
  return {dot(direction, camera.right) * scale, -dot(direction, camera.up) * scale};
}

/// Guides of the denoiser, summed over the samples of a pixel.
struct GuideSum {
  Vec3 albedo, normal;
  void add(const GuideSum& other) {
    albedo = albedo + other.albedo;
    normal = normal + other.normal;
  }
};

/// Samples the pixels of one tile and writes the results to the film.
class Tile {
 public:
  Tile(const FrameJob& job, int tile_x, int tile_y, RayStats& stats)
      : job_(job),
        stats_(stats),
        left_(tile_x * kTile),
        top_(tile_y * kTile),
        width_(std::min(kTile, job.image.width - left_)),
        height_(std::min(kTile, job.image.height - top_)),
        mattes_(job.mattes->layer_count() * kPixels),
        guides_(job.image.denoise ? kPixels : 0) {
    wave_.samples.fill(0);  // make_camera_rays() reads those of eight paths even if there are fewer
  }

  /// Takes all samples, in rounds; after each round only pixels that have not converged continue.
  void sample() {
    if (job_.device_film) copy_device_sums();
    if (!casts_rays()) return;
    for (int first = job_.samples.first, end; first < job_.samples.end; first = end) {
      end = round_end(job_.image.noise, first, job_.samples.end);
      sample_round(first, end);
      if (end < job_.samples.end && !mark_done(end)) return;
    }
  }

  /// Writes colours or, for a part of the picture's samples, the sums of all nodes.
  void write(Image& film) {
    for (int i = 0; i < width_ * height_; ++i) {
      float* pixel = &film.at(left_ + i % width_, top_ + i / width_, 0);
      if (!job_.part_mattes) {
        write_colors(sums_[i].total(), pixel);
        continue;
      }
      for (const auto& node : sums_[i].nodes()) {
        write_node(node.sum, pixel);
        pixel += kNodeChannels;
      }
    }
  }

  /// Intersects the rays through the pixels' centres, if AOVs or steady noise need them.
  void intersect_centers() {
    // Only the rays of samples depend on `moving_`.
    const bool finds_motion = casts_rays() && job_.needs_motion_test();
    moving_.fill(job_.camera.moves);
    if (job_.aovs.empty() && !finds_motion) return;
    for (int y = 0; y < height_; ++y) {
      CenterRow& row = centers_[y];
      const Pack film_y = broadcast<Pack>(static_cast<float>(top_ + y));
      for (int k = 0; k < kTile / kLanes; ++k) {
        const Pack film_x = Lanes<Pack>::iota() + static_cast<float>(left_ + k * kLanes);
        row.rays[k] = center_rays<Pack3>(job_.camera, film_x, film_y);
      }
      if (job_.device_film)
        copy_device_centers(y);
      else
        intersect_closest(job_.world, row.rays, row.intersections, width_, /*coherent=*/true,
                          stats_);
      if (!finds_motion) continue;
      for (int x = 0; x < width_; ++x) {
        const std::uint32_t mesh = row.intersections[x / kLanes].mesh.mesh[x % kLanes];
        moving_[y * width_ + x] = mesh != kNoMesh && job_.world.geometry->mesh(mesh).moves;
      }
    }
  }

  /// Writes ids and coverages into the channels that follow the AOVs.
  void write_mattes(Image& film) {
    const std::size_t layers = job_.mattes->layer_count();
    for (int i = 0; i < width_ * height_; ++i) {
      const auto samples = static_cast<float>(sums_[i].total().samples);
      float* pixel = &film.at(left_ + i % width_, top_ + i / width_,
                              job_.first_aov + static_cast<int>(job_.aovs.size()));
      for (std::size_t layer = 0; layer < layers; ++layer) {
        const auto rank =
            mattes_[static_cast<std::size_t>(i) * layers + layer].total().rank(samples);
        pixel = std::copy(rank.begin(), rank.end(), pixel);
      }
    }
  }

  /// Copies the tile's matte sums to those of the part.
  void copy_matte_sums() {
    const std::size_t layers = job_.mattes->layer_count();
    for (std::size_t i = 0; i < mattes_.size(); ++i) {
      const auto pixel = static_cast<int>(i / layers);
      if (pixel >= width_ * height_) break;  // the tile reaches beyond the picture
      const auto x = static_cast<std::size_t>(left_ + pixel % width_),
                 y = static_cast<std::size_t>(top_ + pixel / width_);
      const auto& nodes = mattes_[i].nodes();
      const std::size_t offset =
          ((y * static_cast<std::size_t>(job_.image.width) + x) * layers + i % layers) *
          nodes.size();
      for (std::size_t node = 0; node < nodes.size(); ++node)
        (*job_.part_mattes)[offset + node] = nodes[node].sum;
    }
  }

  /// Writes the guides into the last six channels.
  void write_guides(Image& film) {
    for (int i = 0; i < width_ * height_; ++i) {
      const float n = static_cast<float>(sums_[i].total().samples);
      const GuideSum sum = guides_[i].total();
      const Vec3 albedo = sum.albedo / n, normal = sum.normal / n;
      float* pixel = &film.at(left_ + i % width_, top_ + i / width_,
                              static_cast<int>(film.channel_count()) - 6);
      for (const float value : {albedo.x, albedo.y, albedo.z, normal.x, normal.y, normal.z})
        *pixel++ = std::isfinite(value) ? value : 0;
    }
  }

  void write_aovs(Image& film) {
    const bool has_motion = has_aov("motion");
    const CostlyValues values{has_aov("albedo"), has_aov("uv")};
    for (int y = 0; y < height_; ++y)
      for (int k = 0; k * kLanes < width_; ++k) {
        const RayOf<Pack3>& rays = centers_[y].rays[k];
        FirstHit hits[kLanes];
        // The paths of one sample through the pixels' centres are those of the pixels, in order.
        const bool is_shaded = job_.samples_centers && !job_.device_film;
        find_first_hits(job_.world, rays, centers_[y].intersections[k], values,
                        is_shaded ? &wave_.shaded_hits[y * width_ + k * kLanes] : nullptr, hits);
        for (int l = 0; l < kLanes && k * kLanes + l < width_; ++l) {
          FirstHit& hit = hits[l];
          const Vec3 direction = lane(rays.direction, l);
          // Convert the distance along the ray to that along the view axis.
          if (hit.id > 0) hit.depth *= dot(direction, job_.camera.camera.forward);
          if (has_motion) hit.motion = compute_motion(hit, direction);
          float* pixel = &film.at(left_ + k * kLanes + l, top_ + y, job_.first_aov);
          for (const Aov* aov : job_.aovs) *pixel++ = aov->value(hit);
        }
      }
  }

 private:
  /// Tests whether this tile casts the camera rays of samples: to trace them or, if a GPU has
  /// traced them, only for mattes and guides.
  bool casts_rays() const { return !job_.device_film || needs_first_hits(job_); }

  bool has_aov(std::string_view layer) const {
    return std::any_of(job_.aovs.begin(), job_.aovs.end(),
                       [&](const Aov* aov) { return aov->layer == layer; });
  }
  std::size_t film_index(int x, int y) const {
    return static_cast<std::size_t>(top_ + y) * static_cast<std::size_t>(job_.image.width) +
           static_cast<std::size_t>(left_ + x);
  }
  /// Copies the sums of all samples from a GPU's film.
  void copy_device_sums() {
    const DeviceFilm& film = *job_.device_film;
    for (int i = 0; i < width_ * height_; ++i) {
      const PixelSum* sums = &film.sums[film_index(i % width_, i / width_) * film.nodes.size()];
      // A pixel that converged early has only the first node, with fewer samples.
      for (const BlockSpan node : film.nodes) {
        if (sums->samples == 0) break;
        sums_[i].add({{node.first, (sums->samples + kSampleBlock - 1) / kSampleBlock}, *sums});
        ++sums;
      }
    }
  }
  /// Copies the hits at the centres of a row's pixels from a GPU's film.
  void copy_device_centers(int y) {
    CenterRow& row = centers_[y];
    for (int k = 0; k < kTile / kLanes; ++k)
      row.intersections[k] = {/*mesh=*/{}, intersect_floor(job_.world.floor, row.rays[k])};
    for (int x = 0; x < width_; ++x) {
      const MeshHit& hit = job_.device_film->centers[film_index(x, y)];
      MeshHitOf<Pack>& hits = row.intersections[x / kLanes].mesh;
      const int l = x % kLanes;
      hits.mesh[l] = hit.mesh;
      hits.triangle[l] = hit.triangle;
      hits.distance[l] = hit.distance;
      hits.u[l] = hit.u;
      hits.v[l] = hit.v;
    }
  }

  /// Takes the samples [from, to) of the pixels that are not done. The range consists of whole
  /// blocks, except for the picture's last block.
  void sample_round(int from, int to) {
    last_sample_ = static_cast<std::uint32_t>(to - 1);
    for (int pixel = 0; pixel < width_ * height_; ++pixel) {
      if (done_[pixel]) continue;
      const int column = left_ + pixel % width_, row = top_ + pixel / width_;
      // The index of a sample is that of the pixel's first one plus the sample's number.
      const SampleIndex first =
          sample_index(job_.sampler, column, row, /*sample=*/0, moving_[pixel]);
      wave_.sequence = first.sequence;  // the same for the whole tile (SampleIndex)
      for (int s = from; s < to; ++s) {
        const int path = wave_.count;
        pixels_[path] = pixel;
        columns_[path] = static_cast<float>(column);
        rows_[path] = static_cast<float>(row);
        sample_indices_[path] = static_cast<std::uint32_t>(s);
        wave_.samples[path] = first.reversed | reverse_bits(static_cast<std::uint32_t>(s));
        if (++wave_.count == Wavefront::kMax) flush();
      }
    }
    if (wave_.count > 0) flush();
  }

  /// Makes the camera rays of the samples that the wave has collected, and traces what is needed of
  /// them: mattes and guides, and the light unless a GPU has traced it.
  void flush() {
    check_interruption();  // a tile of many samples takes seconds
    if (job_.samples_centers)
      copy_centers();
    else
      for (int first = 0; first < wave_.count; first += kLanes) make_camera_rays(first);
    if (needs_first_hits(job_)) add_mattes_and_guides();
    if (!job_.device_film) trace_wave();
    wave_.count = 0;
  }
  /// Traces the light along the wave's rays, and adds it to the sums of the pixels.
  void trace_wave() {
    trace(job_.world, job_.sampler, wave_, stats_);
    for (int i = 0; i < wave_.count; ++i) {
      SampleSums<PixelSum>& sums = sums_[pixels_[i]];
      add_sample(sums.block(), wave_.path_lights[i], sample_indices_[i] % 2 == 1);
      if (ends_block(i)) sums.end_block(block_index(i));
    }
  }

  int block_index(int path) const { return static_cast<int>(sample_indices_[path]) / kSampleBlock; }
  /// Tests whether the path's sample is the last of its block.
  bool ends_block(int path) const {
    const std::uint32_t sample = sample_indices_[path];
    return sample % kSampleBlock == kSampleBlock - 1 || sample == last_sample_;
  }

  /// Adds mattes and guides from the first intersections of the wave's camera rays. The rays are
  /// traced again for this, because few images need it.
  void add_mattes_and_guides() {
    for (int first = 0; first < wave_.count; first += kPacket) {
      const int count = std::min(kPacket, wave_.count - first);
      RayOf<Pack3> rays[kPacket / kLanes];
      IntersectionOf<Pack> intersections[kPacket / kLanes];
      for (int i = 0; i < kPacket; ++i) {
        const Ray& ray = wave_.rays[first + std::min(i, count - 1)];  // repeats the last one
        RayOf<Pack3>& pack = rays[i / kLanes];
        set_lane(pack.origin, i % kLanes, ray.origin);
        set_lane(pack.direction, i % kLanes, ray.direction);
        pack.time[i % kLanes] = ray.time;
      }
      intersect_closest(job_.world, rays, intersections, count, /*coherent=*/true, stats_);
      for (int i = 0; i < count; ++i)
        add_matte_and_guide(first + i, lane(intersections[i / kLanes], i % kLanes));
    }
  }
  void add_matte_and_guide(int path, const Intersection& intersection) {
    const Ray& ray = wave_.rays[path];
    const auto pixel = static_cast<std::size_t>(pixels_[path]);
    const bool is_last_of_block = ends_block(path);
    if (!mattes_.empty()) {
      const std::size_t layers = job_.mattes->layer_count();
      SampleSums<MattePixel>* sums = &mattes_[pixel * layers];
      job_.mattes->add_sample(job_.world, ray, intersection, sums);
      for (std::size_t layer = 0; is_last_of_block && layer < layers; ++layer)
        sums[layer].end_block(block_index(path));
    }
    if (!job_.image.denoise) return;
    const Guide guide = trace_guide(job_.world, ray, intersection, stats_);
    guides_[pixel].block().add({guide.albedo, guide.normal});
    if (is_last_of_block) guides_[pixel].end_block(block_index(path));
  }

  /// Copies the rays through the pixels' centres, and their intersections, to the wave. Its paths
  /// are those of the tile's pixels, in order.
  void copy_centers() {
    static_assert(kPixels <= Wavefront::kMax);
    wave_.is_intersected = true;
    Ray unused_ray;  // receives the lanes beyond the tile's right edge
    IntersectionRow unused_intersection;
    for (int y = 0; y < height_; ++y)
      for (int k = 0; k * kLanes < width_; ++k) {
        Pack columns[kLanes] = {};
        float *rays[kLanes], *intersections[kLanes];
        for (int l = 0; l < kLanes; ++l) {
          const int x = k * kLanes + l, path = y * width_ + x;
          rays[l] = x < width_ ? &wave_.rays[path].origin.x : &unused_ray.origin.x;
          intersections[l] = reinterpret_cast<float*>(x < width_ ? &wave_.intersections[path]
                                                                 : &unused_intersection);
        }
        static_assert(sizeof centers_[y].rays[k] == sizeof columns);
        std::memcpy(columns, &centers_[y].rays[k], sizeof columns);
        store_rows<kLanes>(columns, rays);
        std::memcpy(columns, &centers_[y].intersections[k], sizeof centers_[y].intersections[k]);
        store_rows<kLanes>(columns, intersections);
      }
  }

  /// Makes the camera rays of the wave's paths [first, first + 8).
  void make_camera_rays(int first) {
    PackBits index;
    std::memcpy(&index, &wave_.samples[first], sizeof index);
    const PathSamplerOf<Pack> sampler(job_.sampler, wave_.sequence, index);
    const RayOf<Pack3> rays =
        sample_camera_rays<Pack3>(job_.camera, sampler, Lanes<Pack>::load(&columns_[first]),
                                  Lanes<Pack>::load(&rows_[first]));
    Pack columns[kLanes];
    static_assert(sizeof rays == sizeof columns && sizeof(Ray) == kLanes * sizeof(float));
    std::memcpy(columns, &rays, sizeof columns);
    float* starts[kLanes];
    for (int l = 0; l < kLanes; ++l) starts[l] = &wave_.rays[first + l].origin.x;
    store_rows<kLanes>(columns, starts);
  }

  /// Marks the pixels that are done after their first `samples` samples: those that have converged
  /// or, if a GPU has traced the samples, those that have no more. Returns whether any are left.
  bool mark_done(int samples) {
    if (!job_.device_film)
      return mark_converged(
          width_, height_, job_.image.noise,
          [&](int x, int y) { return sums_[y * width_ + x].total(); },
          [&](int x, int y) -> bool& { return done_[y * width_ + x]; });
    bool any_left = false;
    for (int i = 0; i < width_ * height_; ++i) {
      done_[i] = sums_[i].total().samples <= samples;
      any_left = any_left || !done_[i];
    }
    return any_left;
  }

  /// Computes the motion to the next frame, in pixels.
  Vec2 compute_motion(const FirstHit& hit, Vec3 direction) const {
    const Camera &current = job_.camera.camera, &next = job_.next_camera;
    // A sky is infinitely far away. The studio's paper moves with the camera, so its motion is 0.
    const bool is_sky = hit.id == 0 && job_.world.backdrop.shows_sky;
    if (hit.id == 0 && !is_sky) return {};
    const Vec2 from =
        project_to_film(current, job_.image, is_sky ? direction : hit.position - current.position);
    const Vec2 to =
        project_to_film(next, job_.image, is_sky ? direction : hit.next - next.position);
    return {to.x - from.x, to.y - from.y};
  }

  const FrameJob& job_;
  RayStats& stats_;
  const int left_, top_, width_, height_;
  std::array<SampleSums<PixelSum>, kPixels> sums_{};
  std::array<bool, kPixels> done_{};            ///< pixels that get no more samples
  std::vector<SampleSums<MattePixel>> mattes_;  ///< one per pixel and layer; layers run fastest
  std::vector<SampleSums<GuideSum>> guides_;    ///< one per pixel, or empty without denoising
  /// Rays through the centres of a row's pixels.
  struct CenterRow {
    RayOf<Pack3> rays[kTile / kLanes];
    IntersectionOf<Pack> intersections[kTile / kLanes];
  };
  std::array<CenterRow, kTile> centers_;
  std::array<bool, kPixels> moving_{};  ///< whether the pixel's centre shows something that moves
  Wavefront wave_;
  std::array<int, Wavefront::kMax> pixels_;                ///< pixel per path of the wave
  std::array<float, Wavefront::kMax> columns_{}, rows_{};  ///< coordinates of that pixel
  std::array<std::uint32_t, Wavefront::kMax>
      sample_indices_;             ///< index of the sample within the pixel, per path
  std::uint32_t last_sample_ = 0;  ///< index of the last sample of the round
};

}  // namespace

void render_tile(const FrameJob& job, int tile_x, int tile_y, Image& film, RayStats& stats) {
  const FlushDenormals flush;
  Tile tile(job, tile_x, tile_y, stats);
  tile.intersect_centers();
  tile.sample();
  tile.write(film);
  if (!job.aovs.empty()) tile.write_aovs(film);
  if (job.part_mattes)
    tile.copy_matte_sums();
  else if (job.mattes->layer_count() > 0)
    tile.write_mattes(film);
  if (job.image.denoise) tile.write_guides(film);
}

}  // namespace polymorph
