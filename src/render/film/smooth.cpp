#include "render/film/smooth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "base/result.h"
#include "image/rgb_channels.h"

namespace polymorph {
namespace {

constexpr int kPasses = 4;                    // taps are 1, 2, 4, 8 pixels apart
constexpr int kMargin = 1 << (kPasses - 1);   // pixels; distance of the farthest tap
constexpr float kMinAlbedo = 0.02f;           // a smaller divisor would amplify specular light
constexpr float kMinCosine = 0.8f;            // cosine between the normals of adjacent pixels
constexpr float kMaxAlbedoDifference = 0.2f;  // relative difference between adjacent pixels
constexpr float kDepthJump = 0.05f;           // relative difference that separates two surfaces
constexpr float kDepthFalloff = 0.02f;  // relative change per pixel at which a tap's weight is 0
constexpr float kDeviations = 4;        // standard deviations at which a weight is halved
constexpr float kUnbounded = std::numeric_limits<float>::infinity();
/// Key of all pixels that are not interior (find_interior_pixels()). NaN equals no key, not even
/// itself.
constexpr float kNoKey = std::numeric_limits<float>::quiet_NaN();

/// A value per pixel of the picture and of a margin of kMargin pixels around it.
using Plane = std::vector<float>;
using Colors = std::array<Plane, 3>;

/// Returns max(v, 0) without a branch, so that compilers vectorize loops with it.
float positive_part(float v) { return 0.5f * (v + std::fabs(v)); }

/// Filter of one film. Loops over the pixels of a row have no branches, so that compilers vectorize
/// them. The order of each pixel's sums does not depend on the vector width.
class Smoother {
 public:
  explicit Smoother(Image& film)
      : film_(film),
        width_(film.width),
        height_(film.height),
        stride_(film.width + 2 * kMargin),
        channels_(find_rgb(film)),
        size_(static_cast<std::size_t>(stride_) *
              static_cast<std::size_t>(film.height + 2 * kMargin)) {}

  void run() {
    load_layers();
    find_interior_pixels();
    estimate_variance();
    for (int pass = 0; pass < kPasses; ++pass) smooth(pass);
    find_bounds();
    find_silhouettes();
    make_colors();
    find_residuals();
    write();
  }

 private:
  /// Index of the first pixel of a row in a plane.
  std::size_t row_begin(int y) const {
    return static_cast<std::size_t>(y + kMargin) * static_cast<std::size_t>(stride_) + kMargin;
  }
  /// Calls f(first pixel of a row) for each row of the picture, in parallel.
  template <class F>
  void for_rows(const F& f) const {
    parallel_for(
        height_, [&](std::int64_t y) { f(row_begin(static_cast<int>(y))); }, /*grain=*/16);
  }
  /// Calls f(first pixel of a row, offset to a neighbour) for each row and each of the eight
  /// neighbours.
  template <class F>
  void for_neighbours(const F& f) const {
    for_rows([&](std::size_t first) {
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
          if (dx != 0 || dy != 0) f(first, dy * std::ptrdiff_t{stride_} + dx);
    });
  }

  /// Calls f(pixel, x, y) for the pixels of the picture.
  template <class F>
  void for_pixels(const F& f) const {
    parallel_for(
        height_,
        [&](std::int64_t line) {
          const int y = static_cast<int>(line);
          for (int x = 0; x < width_; ++x) f(row_begin(y) + static_cast<std::size_t>(x), x, y);
        },
        /*grain=*/16);
  }
  /// Averages `light_` over the pixels at most two rows and columns from (x, y) for which
  /// accepts(pixel) is true. Returns nullopt if there are none.
  template <class F>
  std::optional<std::array<float, 3>> mean_near(int x, int y, const F& accepts) const {
    float count = 0;
    std::array<float, 3> sum{};
    for (int v = std::max(y - 2, 0); v <= std::min(y + 2, height_ - 1); ++v)
      for (int u = std::max(x - 2, 0); u <= std::min(x + 2, width_ - 1); ++u) {
        const std::size_t q = row_begin(v) + static_cast<std::size_t>(u);
        if (!accepts(q)) continue;
        for (std::size_t c = 0; c < 3; ++c) sum[c] += light_[c][q];
        ++count;
      }
    if (count == 0) return {};
    for (float& value : sum) value = value / count;
    return sum;
  }
  /// Tests whether the light of a pixel is free of noise: it has been smoothed, or nothing is hit.
  bool has_smooth_light(std::size_t i) const { return key_[i] >= 0 || !(id_[i] > 0); }

  /// Copies the film's layers to planes, whose margins repeat the outermost pixels, and divides the
  /// colours by the albedos. Values that are not finite become 0.
  void load_layers() {
    struct Layer {
      const char* name;
      Plane* plane;
    };
    const Layer layers[] = {{"id", &id_},
                            {"Z", &depth_},
                            {"R", &light_[0]},
                            {"G", &light_[1]},
                            {"B", &light_[2]},
                            {"N.X", &normal_[0]},
                            {"N.Y", &normal_[1]},
                            {"N.Z", &normal_[2]},
                            {"albedo.R", &albedo_[0]},
                            {"albedo.G", &albedo_[1]},
                            {"albedo.B", &albedo_[2]}};
    constexpr std::size_t kLayers = std::size(layers);
    std::array<std::size_t, kLayers> channels;
    std::array<float*, kLayers> planes;
    for (std::size_t k = 0; k < kLayers; ++k) {
      const int channel = film_.find_channel(layers[k].name);
      PM_CHECK(channel >= 0);
      channels[k] = static_cast<std::size_t>(channel);
      layers[k].plane->resize(size_);
      planes[k] = layers[k].plane->data();
    }
    inv_depth_range_.resize(size_);
    // Loads a row of the planes, including the margin. Line 0 is the topmost row of the margin.
    const auto load_line = [&](std::int64_t line) {
      const int y = std::clamp(static_cast<int>(line) - kMargin, 0, height_ - 1);
      const std::size_t first = static_cast<std::size_t>(line) * static_cast<std::size_t>(stride_);
      const std::size_t end = first + static_cast<std::size_t>(stride_);
      for (std::size_t i = first; i < end; ++i) {
        const int x = static_cast<int>(i - first) - kMargin;
        const float* pixel = &film_.at(std::clamp(x, 0, width_ - 1), y, 0);
        for (std::size_t k = 0; k < kLayers; ++k) {
          const float value = pixel[channels[k]];
          planes[k][i] = std::isfinite(value) ? value : 0;
        }
      }
      divide_by_albedo(first, end);
    };
    parallel_for(height_ + 2 * kMargin, load_line, /*grain=*/16);
  }
  /// Divides the colours of the pixels [first, end) by their albedos, and sets `albedo_` to the
  /// divisors: at least kMinAlbedo, and 1 where nothing is hit. Sets `inv_depth_range_`.
  void divide_by_albedo(std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i) inv_depth_range_[i] = 1 / (kDepthFalloff * depth_[i]);
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t i = first; i < end; ++i) {
        const float albedo = std::max(kMinAlbedo, albedo_[c][i]);
        albedo_[c][i] = id_[i] > 0 ? albedo : 1;
        light_[c][i] = light_[c][i] / albedo_[c][i];
      }
  }

  /// Finds the interior pixels: their neighbours show the same surface with similar normals and
  /// albedos. Sets `key_` to the surface's id there, and to kNoKey elsewhere. Sets `low_` and
  /// `high_` to the extremes of albedo in the 3 x 3 pixels around each pixel.
  void find_interior_pixels() {
    key_.assign(size_, kNoKey);
    low_ = high_ = albedo_;
    for_rows([&](std::size_t first) {
      for (int x = 0; x < width_; ++x)
        key_[first + x] = id_[first + x] > 0 ? id_[first + x] : kNoKey;
    });
    for_neighbours([&](std::size_t first, std::ptrdiff_t offset) {
      const auto& [nx, ny, nz] = normal_;
      const float *id = &id_[first], *x0 = &nx[first], *y0 = &ny[first], *z0 = &nz[first];
      float* key = &key_[first];
      for (int x = 0; x < width_; ++x) {
        const std::ptrdiff_t q = x + offset;
        const float cosine = x0[x] * x0[q] + y0[x] * y0[q] + z0[x] * z0[q];
        const float smooth_key = cosine > kMinCosine ? key[x] : kNoKey;
        key[x] = id[x] == id[q] ? smooth_key : kNoKey;
      }
      for (std::size_t c = 0; c < 3; ++c) {
        const float* albedo = &albedo_[c][first];
        float *low = &low_[c][first], *high = &high_[c][first];
        for (int x = 0; x < width_; ++x) {
          const float own = albedo[x], other = albedo[x + offset];
          key[x] = std::fabs(own - other) <= kMaxAlbedoDifference * std::max(own, other) ? key[x]
                                                                                         : kNoKey;
          low[x] = std::min(low[x], other);
          high[x] = std::max(high[x], other);
        }
      }
    });
  }

  /// Sets `guide_` to the mean brightness around each interior pixel, and `variance_` to the
  /// brightness's variance there. Means are over 3 x 3 pixels.
  void estimate_variance() {
    Plane count(size_, 1.0f), brightness(size_), variance;
    for_neighbours([&](std::size_t first, std::ptrdiff_t offset) {
      const float* key = &key_[first];
      float* to = &count[first];
      for (int x = 0; x < width_; ++x) {
        to[x] += key[x] == key[x + offset] ? 1.0f : 0.0f;
      }
    });
    measure_brightness(brightness);
    guide_ = mean_around(brightness, count);
    for (float& value : brightness) value = value * value;
    variance = mean_around(brightness, count);
    for (std::size_t i = 0; i < size_; ++i)
      variance[i] = std::max(0.0f, variance[i] - guide_[i] * guide_[i]);  // 0 for NaN, too
    variance_ = mean_around(variance, count);
  }
  void measure_brightness(Plane& to) const {
    for (std::size_t i = 0; i < size_; ++i)
      to[i] = (light_[0][i] + light_[1][i] + light_[2][i]) * (1 / 3.0f);
  }
  /// Computes for each pixel the mean over those of the 3 x 3 pixels around it that have its key.
  /// `count`: their number. A pixel that is not interior keeps its own value.
  Plane mean_around(const Plane& plane, const Plane& count) const {
    Plane sum = plane;
    for_neighbours([&](std::size_t first, std::ptrdiff_t offset) {
      const float *key = &key_[first], *value = &plane[first];
      float* to = &sum[first];
      for (int x = 0; x < width_; ++x) {
        const float other = value[x + offset];
        to[x] += key[x] == key[x + offset] ? other : 0.0f;
      }
    });
    for (std::size_t i = 0; i < size_; ++i) sum[i] = sum[i] / count[i];
    return sum;
  }

  /// Runs one filter pass: weighted means over 3 x 3 taps that are 2^pass pixels apart.
  void smooth(int pass) {
    const int step = 1 << pass;
    if (pass > 0) measure_brightness(guide_);
    // Each pass is assumed to halve the standard deviation of the noise.
    const float variance_factor = kDeviations * kDeviations / static_cast<float>(1 << (2 * pass));
    next_ = light_;
    for_rows([&](std::size_t first) {
      std::vector<float> total(static_cast<std::size_t>(width_), 1), weights(total);
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          if (dx == 0 && dy == 0) continue;
          const float kernel =
              dx == 0 || dy == 0 ? 0.5f : 0.25f;  // relative to the centre's weight
          add_tap({first, step * (dy * std::ptrdiff_t{stride_} + dx), kernel, variance_factor,
                   1 / static_cast<float>(step)},
                  weights.data());
          for (std::size_t x = 0; x < total.size(); ++x) total[x] += weights[x];
        }
      for (Plane& plane : next_) {
        float* sum = &plane[first];
        for (std::size_t x = 0; x < total.size(); ++x) sum[x] = sum[x] / total[x];
      }
    });
    std::swap(light_, next_);
  }

  /// One of the eight taps of a filter pass, for the pixels of a row.
  struct Tap {
    std::size_t first;      ///< index of the row's first pixel
    std::ptrdiff_t offset;  ///< index of a pixel's tap, less that of the pixel
    float kernel;           ///< weight relative to the pixel's own, before edges reduce it
    float variance_factor;  ///< (change of brightness)^2 / variance that halves the weight
    float depth_scale;      ///< 1 / distance of the tap in pixels
  };
  /// Computes the weights of a tap for the pixels of a row, and adds the weighted light to `next_`.
  void add_tap(const Tap& tap, float* __restrict weights) {
    // Pointers to the row, and to the taps of its pixels.
    const auto own = [&](const Plane& plane) { return plane.data() + tap.first; };
    const auto other = [&](const Plane& plane) { return own(plane) + tap.offset; };
    const float *x0 = own(normal_[0]), *y0 = own(normal_[1]), *z0 = own(normal_[2]),
                *x1 = other(normal_[0]), *y1 = other(normal_[1]), *z1 = other(normal_[2]),
                *key0 = own(key_), *key1 = other(key_), *depth0 = own(depth_),
                *depth1 = other(depth_), *inv_depth_range = own(inv_depth_range_),
                *guide0 = own(guide_), *guide1 = other(guide_), *variance = own(variance_);
    for (int x = 0; x < width_; ++x) {
      const float cosine = positive_part(x0[x] * x1[x] + y0[x] * y1[x] + z0[x] * z1[x]);
      const float c4 = cosine * cosine * cosine * cosine, c16 = c4 * c4 * c4 * c4;
      const float depth_change =
          std::fabs(depth1[x] - depth0[x]) * inv_depth_range[x] * tap.depth_scale;
      const float depth_weight = positive_part(1 - depth_change);
      const float change = guide1[x] - guide0[x];
      // The brightness weight is 1 / (1 + change^2 / noise).
      const float noise = variance[x] * tap.variance_factor + 1e-6f;  // never 0
      // The normals' weight is cosine^32.
      weights[x] = tap.kernel * (c16 * c16) * depth_weight * noise / (noise + change * change);
    }
    for (int x = 0; x < width_; ++x) weights[x] = key0[x] == key1[x] ? weights[x] : 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const float* light = other(light_[c]);
      float* sum = &next_[c][tap.first];
      for (int x = 0; x < width_; ++x) sum[x] += weights[x] * light[x];
    }
  }

  /// Sets `low_` and `high_` to bounds for pixels that are not interior: the extremes of smoothed
  /// light at most two pixels away, times the extremes of albedo. Takes the extremes along rows,
  /// then along columns.
  void find_bounds() {
    // `next_` is free here. Its planes hold the extremes of one channel.
    Plane &low = next_[0], &high = next_[1], &low_before = next_[2];
    Plane high_before;
    std::fill(low.begin(), low.end(), kUnbounded);
    std::fill(high.begin(), high.end(), -kUnbounded);
    for (std::size_t c = 0; c < 3; ++c) {
      for_rows([&](std::size_t first) {
        for (std::size_t i = first; i < first + width_; ++i) {
          const bool is_smooth = has_smooth_light(i);
          low[i] = is_smooth ? light_[c][i] : kUnbounded;
          high[i] = is_smooth ? light_[c][i] : -kUnbounded;
        }
      });
      for (const std::ptrdiff_t step : {std::ptrdiff_t{1}, std::ptrdiff_t{stride_}}) {
        low_before = low;
        high_before = high;
        for_rows([&](std::size_t first) {
          for (const std::ptrdiff_t offset : {-2 * step, -step, step, 2 * step})
            for (std::size_t i = first; i < first + width_; ++i) {
              low[i] = std::min(low[i], low_before[i + offset]);
              high[i] = std::max(high[i], high_before[i + offset]);
            }
        });
      }
      for_rows([&](std::size_t first) {
        for (std::size_t i = first; i < first + width_; ++i) {
          low_[c][i] *= low[i];
          high_[c][i] *= high[i];
        }
      });
    }
  }

  /// Marks the pixels next to another surface, which has another id or a depth that differs by
  /// kDepthJump.
  void find_silhouettes() {
    silhouette_.assign(size_, 0);
    for_neighbours([&](std::size_t first, std::ptrdiff_t offset) {
      const float *id = &id_[first], *depth = &depth_[first];
      std::uint8_t* to = &silhouette_[first];
      for (int x = 0; x < width_; ++x) {
        const std::ptrdiff_t q = x + offset;
        const bool is_other_depth =
            std::fabs(depth[x] - depth[q]) > kDepthJump * std::min(depth[x], depth[q]);
        to[x] |=
            static_cast<std::uint8_t>(id[x] != id[q]) | static_cast<std::uint8_t>(is_other_depth);
      }
    });
  }

  /// Averages the light of a silhouette pixel's own surface, over nearby pixels that are not on a
  /// silhouette.
  std::optional<std::array<float, 3>> mean_own_side(std::size_t i, int x, int y) const {
    return mean_near(x, y, [&](std::size_t q) {
      const bool is_same_depth = std::fabs(depth_[i] - depth_[q]) <= kDepthJump * depth_[i];
      return id_[q] == id_[i] && !silhouette_[q] && has_smooth_light(q) && is_same_depth;
    });
  }

  /// Clamps a value of a pixel that is not interior to the bounds that find_bounds() has set.
  float clamp_to_bounds(std::size_t i, std::size_t c, float value) const {
    const bool is_bounded = id_[i] > 0 && low_[c][i] <= high_[c][i];
    return is_bounded ? std::clamp(value, low_[c][i], high_[c][i]) : value;
  }

  /// Sets `next_` to the filtered colour of the surface at each pixel's centre. Interior pixels
  /// (key_ >= 0) have their own smoothed light, and pixels on silhouettes the mean light of the
  /// same surface nearby. All others, and silhouettes without such a mean, have their sampled
  /// colour, clamped to the bounds.
  void make_colors() {
    for_pixels([&](std::size_t i, int x, int y) {
      std::optional<std::array<float, 3>> own_light;
      if (silhouette_[i] != 0) own_light = mean_own_side(i, x, y);
      for (std::size_t c = 0; c < 3; ++c)
        next_[c][i] = key_[i] >= 0 ? light_[c][i] * albedo_[c][i]
                      : own_light  ? (*own_light)[c] * albedo_[c][i]
                                   : clamp_to_bounds(i, c, film_.at(x, y, channels_[c]));
    });
  }

  /// Sets `light_` on silhouettes to the residual: the sampled colour, clamped to the bounds, minus
  /// tent(next_), which blends the filtered colours of both sides.
  void find_residuals() {
    for_pixels([&](std::size_t i, int x, int y) {
      for (std::size_t c = 0; c < 3 && silhouette_[i] != 0; ++c) {
        const float clamped = clamp_to_bounds(i, c, film_.at(x, y, channels_[c]));
        const float difference = clamped - tent(next_[c], x, y);
        light_[c][i] = std::isfinite(difference) ? difference : 0;
      }
    });
  }

  /// Writes `next_` to the film. On silhouettes, where a pixel's few samples fall on either side by
  /// chance, writes tent(next_) plus the mean residual along the silhouette.
  void write() {
    for_pixels([&](std::size_t i, int x, int y) {
      if (silhouette_[i] == 0) {
        for (std::size_t c = 0; c < 3; ++c) film_.at(x, y, channels_[c]) = next_[c][i];
        return;
      }
      // The mean exists, because it includes the pixel itself.
      const auto residual =
          mean_near(x, y, [&](std::size_t q) { return silhouette_[q] != 0 && id_[q] == id_[i]; });
      for (std::size_t c = 0; c < 3; ++c) {
        float& value = film_.at(x, y, channels_[c]);
        const float smooth = clamp_to_bounds(i, c, tent(next_[c], x, y) + (*residual)[c]);
        if (std::isfinite(value) && std::isfinite(smooth)) value = smooth;
      }
    });
  }

  /// Returns the mean of a plane's 3 x 3 values around a pixel, with the weights 1 2 1 along both
  /// axes. Outermost pixels are repeated.
  float tent(const Plane& plane, int x, int y) const {
    float sum = 0;
    for (int dy = -1; dy <= 1; ++dy) {
      const float* line = &plane[row_begin(std::clamp(y + dy, 0, height_ - 1))];
      const float across =
          line[std::max(x - 1, 0)] + 2 * line[x] + line[std::min(x + 1, width_ - 1)];
      sum += (dy == 0 ? 2.0f : 1.0f) * across;
    }
    return sum / 16;
  }

  Image& film_;
  int width_, height_, stride_;
  std::array<int, 3> channels_;  ///< R, G and B in the film
  std::size_t size_;
  // inv_depth_range_: 1 / (kDepthFalloff * depth). key_: id of an interior pixel's surface, or
  // kNoKey. guide_, variance_: mean and variance of the brightness. silhouette_: 1 or 0. light_:
  // colour / albedo, which find_residuals() replaces. next_: result of the current step. low_,
  // high_: extremes of the albedo, which find_bounds() turns into bounds of the colour.
  Plane id_, depth_, inv_depth_range_, key_, guide_, variance_;
  std::vector<std::uint8_t> silhouette_;
  Colors light_, next_, normal_, albedo_, low_, high_;
};

}  // namespace

void smooth_noise(Image& film) { Smoother(film).run(); }

std::uint64_t smooth_bytes(int width, int height) {
  constexpr std::uint64_t kPlanes = 27;  // 24 of Smoother, and three temporary ones
  return kPlanes * sizeof(float) * static_cast<std::uint64_t>(width + 2 * kMargin) *
         static_cast<std::uint64_t>(height + 2 * kMargin);
}

}  // namespace polymorph
