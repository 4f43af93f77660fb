#include "render/film/smooth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "base/result.h"
#include "image/rgb_channels.h"
#include "render/math/simd.h"

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
/// Key of pixels that show a surface, but are not interior (find_interior_pixels()), and of the
/// margin. NaN equals no key, not even itself.
constexpr float kNoKey = std::numeric_limits<float>::quiet_NaN();
constexpr float kSkyKey = -1;  // key of pixels where nothing is hit
constexpr int kPlanes = 21;    // of Smoother

/// A value per pixel of the picture and of a margin of kMargin pixels around it.
using Plane = float*;
using Colors = std::array<Plane, 3>;

Pack load_pack(const float* from) { return Lanes<Pack>::load(from); }
void store_pack(float* to, Pack a) { Lanes<Pack>::store(to, a); }
/// Returns max(a, 0), and NaN for NaN.
Pack positive_part(Pack a) { return max(Pack{}, a); }
Pack3 load_pack3(const Colors& from, std::size_t i) {
  return {load_pack(from[0] + i), load_pack(from[1] + i), load_pack(from[2] + i)};
}
void store_pack3(const Colors& to, std::size_t i, Pack3 a) {
  store_pack(to[0] + i, a.x);
  store_pack(to[1] + i, a.y);
  store_pack(to[2] + i, a.z);
}
Pack brightness(Pack3 a) { return (a.x + a.y + a.z) * (1 / 3.0f); }

/// Number of pixels of a row of Smoother's planes. Beyond the picture's right edge, packs of pixels
/// may extend into the margin.
std::size_t plane_stride(int width) {
  return (static_cast<std::size_t>(width) + kLanes - 1) / kLanes * kLanes + 2 * kMargin;
}
/// Number of floats from one of Smoother's planes to the next. The same pixel of all planes lies in
/// different sets of the first-level cache: 4096 bytes apart, they would evict each other.
std::size_t plane_size(int width, int height) {
  constexpr std::size_t kPage = 1024, kCacheLines = 48;  // floats
  const std::size_t pixels = plane_stride(width) * static_cast<std::size_t>(height + 2 * kMargin);
  return (pixels + kPage - 1) / kPage * kPage + kCacheLines;
}

/// Filter of one film. Computes eight pixels of a row at a time; packs beyond the row's end compute
/// values of the margin, which nothing uses. The order of each pixel's sums does not depend on the
/// vector width.
class Smoother {
 public:
  explicit Smoother(Image& film)
      : film_(film),
        width_(film.width),
        height_(film.height),
        stride_(static_cast<std::ptrdiff_t>(plane_stride(film.width))),
        packs_((film.width + kLanes - 1) / kLanes),
        channels_(find_rgb(film)),
        values_(
            std::make_unique_for_overwrite<float[]>(kPlanes * plane_size(film.width, film.height))),
        silhouettes_(static_cast<std::size_t>(packs_) * static_cast<std::size_t>(film.height)) {
    Plane plane = values_.get();
    const auto next_plane = [&] {
      return std::exchange(plane, plane + plane_size(film.width, film.height));
    };
    for (Plane* to : {&id_, &depth_, &inv_depth_range_, &key_, &guide_, &next_guide_, &variance_})
      *to = next_plane();
    for (Colors* to : {&light_, &next_, &normal_, &albedo_})
      for (Plane& channel : *to) channel = next_plane();
    before_ = {next_plane(), next_plane()};
  }

  void run() {
    load_layers();
    find_interior_pixels();
    estimate_variance();
    for (int pass = 0; pass < kPasses; ++pass) smooth(pass);
    make_colors();
    find_residuals();
    write();
  }

 private:
  /// Index of the first pixel of a row in a plane.
  std::size_t row_begin(int y) const {
    return static_cast<std::size_t>((y + kMargin) * stride_ + kMargin);
  }
  /// Offsets to the pixels that are at most one row and one column away, `step` pixels apart, but
  /// (0, 0), row by row.
  std::array<std::ptrdiff_t, 8> neighbours(int step) const {
    const std::ptrdiff_t s = step, row = step * stride_;
    return {-row - s, -row, -row + s, -s, s, row - s, row, row + s};
  }
  /// Calls f(y) for each row of the picture, in parallel.
  template <class F>
  void for_rows(const F& f) const {
    parallel_for(
        height_, [&](std::int64_t y) { f(static_cast<int>(y)); }, /*grain=*/16);
  }
  /// Calls f(first pixel of a pack) for the packs of the picture that have an interior pixel.
  template <class F>
  void for_interior_packs(const F& f) const {
    for_rows([&](int y) {
      const std::size_t first = row_begin(y);
      for (std::size_t i = first; i < first + static_cast<std::size_t>(width_); i += kLanes)
        if (any(load_pack(key_ + i) > 0)) f(i);
    });
  }
  /// The silhouette pixels of pack k of a row, a bit each: those next to another surface, which has
  /// another id or a depth that differs by kDepthJump.
  std::uint8_t& silhouettes(int y, int k) {
    return silhouettes_[static_cast<std::size_t>(y) * static_cast<std::size_t>(packs_) +
                        static_cast<std::size_t>(k)];
  }
  bool is_silhouette(int x, int y) const {
    return (const_cast<Smoother*>(this)->silhouettes(y, x / kLanes) >> (x % kLanes) & 1) != 0;
  }
  /// The pixels of pack k of a row that lie in the picture, a bit each.
  std::uint32_t picture_lanes(int k) const {
    return (1u << std::min(kLanes, width_ - k * kLanes)) - 1;
  }
  /// Calls f(pixel, x, y) for the silhouette pixels of a row.
  template <class F>
  void for_silhouettes(int y, const F& f) {
    for (int k = 0; k < packs_; ++k)
      for (std::uint32_t bits = silhouettes(y, k); bits != 0; bits &= bits - 1) {
        const int x = k * kLanes + countr_zero(bits);
        f(row_begin(y) + static_cast<std::size_t>(x), x, y);
      }
  }

  /// Averages `light_` over the pixels at most two rows and columns from (x, y) for which
  /// accepts(pixel, its x, its y) is true. Returns nullopt if there are none.
  template <class F>
  std::optional<std::array<float, 3>> mean_near(int x, int y, const F& accepts) const {
    float count = 0;
    std::array<float, 3> sum{};
    for (int v = std::max(y - 2, 0); v <= std::min(y + 2, height_ - 1); ++v)
      for (int u = std::max(x - 2, 0); u <= std::min(x + 2, width_ - 1); ++u) {
        const std::size_t q = row_begin(v) + static_cast<std::size_t>(u);
        if (!accepts(q, u, v)) continue;
        for (std::size_t c = 0; c < 3; ++c) sum[c] += light_[c][q];
        ++count;
      }
    if (count == 0) return {};
    for (float& value : sum) value = value / count;
    return sum;
  }

  /// A channel of the film, and the plane that it is copied to.
  struct Layer {
    const char* name;
    Plane plane;
    std::size_t channel = 0;
  };
  /// Copies the film's layers to planes, whose margins repeat the outermost pixels, and divides the
  /// colours by the albedos. Values that are not finite become 0.
  void load_layers() {
    std::array<Layer, 11> layers{{{"id", id_},
                                  {"Z", depth_},
                                  {"R", light_[0]},
                                  {"G", light_[1]},
                                  {"B", light_[2]},
                                  {"N.X", normal_[0]},
                                  {"N.Y", normal_[1]},
                                  {"N.Z", normal_[2]},
                                  {"albedo.R", albedo_[0]},
                                  {"albedo.G", albedo_[1]},
                                  {"albedo.B", albedo_[2]}}};
    for (Layer& layer : layers) {
      const int channel = film_.find_channel(layer.name);
      PM_CHECK(channel >= 0);
      layer.channel = static_cast<std::size_t>(channel);
    }
    // Loads a row of the planes, including the margin. Line 0 is the topmost row of the margin.
    const auto load_line = [&](std::int64_t line) {
      const int y = std::clamp(static_cast<int>(line) - kMargin, 0, height_ - 1);
      const auto first = static_cast<std::size_t>(line * stride_);
      load_row(layers, y, first + kMargin);
      for (const Layer& layer : layers) {
        float *begin = layer.plane + first, *row = begin + kMargin;
        std::fill(begin, row, row[0]);
        std::fill(row + width_, begin + stride_, row[width_ - 1]);
      }
      divide_by_albedo(first, first + static_cast<std::size_t>(stride_));
      std::fill_n(key_ + first, stride_, kNoKey);
    };
    parallel_for(height_ + 2 * kMargin, load_line, /*grain=*/16);
  }
  /// Copies row y of the film to the planes of `layers`, from pixel `first` on. Values that are not
  /// finite become 0. Transposes eight channels of eight pixels at a time.
  void load_row(const std::array<Layer, 11>& layers, int y, std::size_t first) const {
    const std::size_t count = film_.channel_count();  // at least 11
    for (std::size_t block = 0; block < count; block += kLanes) {
      const auto is_in_block = [&](const Layer& layer) {
        return layer.channel / kLanes == block / kLanes;
      };
      if (std::none_of(layers.begin(), layers.end(), is_in_block)) continue;
      const std::size_t base = std::min(block, count - kLanes);
      const float* row =
          &film_.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) * count +
                        base];
      for (int x = 0; x < width_; x += kLanes) {
        const float* pixels[kLanes];
        for (int l = 0; l < kLanes; ++l)
          pixels[l] = row + static_cast<std::size_t>(std::min(x + l, width_ - 1)) * count;
        Pack channels[kLanes];
        load_rows<kLanes>(pixels, channels);
        for (const Layer& layer : layers) {
          if (!is_in_block(layer)) continue;
          const Pack value = channels[layer.channel - base];
          store_pack(layer.plane + first + x, zero_unless(abs(value) < kUnbounded, value));
        }
      }
    }
  }
  /// Divides the colours of the pixels [first, end) by their albedos, and sets `albedo_` to the
  /// divisors: at least kMinAlbedo, and 1 where nothing is hit. Sets `inv_depth_range_`, and
  /// `before_[0]` to the brightness.
  void divide_by_albedo(std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; i += kLanes) {
      store_pack(inv_depth_range_ + i, 1 / (kDepthFalloff * load_pack(depth_ + i)));
      const PackMask is_hit = load_pack(id_ + i) > 0;
      const Pack minimum = broadcast<Pack>(kMinAlbedo), one = broadcast<Pack>(1);
      for (std::size_t c = 0; c < 3; ++c) {
        const Pack divisor = select(is_hit, max(load_pack(albedo_[c] + i), minimum), one);
        store_pack(albedo_[c] + i, divisor);
        store_pack(light_[c] + i, load_pack(light_[c] + i) / divisor);
      }
      store_pack(before_[0] + i, brightness(load_pack3(light_, i)));
    }
  }

  /// Finds the interior pixels: their neighbours show the same surface with similar normals and
  /// albedos. Sets `key_` to the surface's id there, to kSkyKey where nothing is hit, and to kNoKey
  /// elsewhere. Marks the silhouettes.
  void find_interior_pixels() {
    const auto offsets = neighbours(1);
    for_rows([&](int y) {
      const std::size_t first = row_begin(y);
      for (int k = 0; k < packs_; ++k) {
        const std::size_t i = first + static_cast<std::size_t>(k * kLanes);
        const Pack id = load_pack(id_ + i), depth = load_pack(depth_ + i);
        const PackMask is_hit = id > 0;
        PackMask is_interior = is_hit, is_silhouette{};
        for (const std::ptrdiff_t offset : offsets) {
          const std::size_t q = i + static_cast<std::size_t>(offset);
          const Pack other_depth = load_pack(depth_ + q);
          const PackMask is_same = id == load_pack(id_ + q);
          is_silhouette |=
              ~is_same | (abs(depth - other_depth) > kDepthJump * min(other_depth, depth));
          is_interior &= is_same;
        }
        if (any(is_interior)) is_interior &= is_even(i, offsets);
        silhouettes(y, k) =
            static_cast<std::uint8_t>(Lanes<Pack>::bits(is_silhouette) & picture_lanes(k));
        const Pack hit_key = select(is_interior, id, broadcast<Pack>(kNoKey));
        store_pack(key_ + i, select(is_hit, hit_key, broadcast<Pack>(kSkyKey)));
      }
      const auto width = static_cast<std::size_t>(width_);
      std::fill(key_ + first + width, key_ + first + static_cast<std::size_t>(packs_ * kLanes),
                kNoKey);
    });
  }
  /// Tests which pixels of a pack have neighbours with similar normals and albedos.
  PackMask is_even(std::size_t i, const std::array<std::ptrdiff_t, 8>& offsets) const {
    const Pack3 normal = load_pack3(normal_, i);
    PackMask is_even = broadcast_mask<PackMask>(true);
    for (const std::ptrdiff_t offset : offsets) {
      const std::size_t q = i + static_cast<std::size_t>(offset);
      is_even &= dot(normal, load_pack3(normal_, q)) > kMinCosine;
      for (const Plane albedo : albedo_) {
        const Pack own = load_pack(albedo + i), other = load_pack(albedo + q);
        is_even &= abs(own - other) <= kMaxAlbedoDifference * max(own, other);
      }
    }
    return is_even;
  }

  /// Sets `guide_` to the mean brightness around each interior pixel, and `variance_` to the
  /// brightness's variance there. Means are over those of 3 x 3 pixels that have the pixel's key.
  void estimate_variance() {
    const auto offsets = neighbours(1);
    for_interior_packs([&](std::size_t i) {
      const Pack key = load_pack(key_ + i), own = load_pack(before_[0] + i);
      Pack count = broadcast<Pack>(1), sum = own, squares = own * own;
      for (const std::ptrdiff_t offset : offsets) {
        const std::size_t q = i + static_cast<std::size_t>(offset);
        const PackMask is_same = key == load_pack(key_ + q);
        const Pack other = load_pack(before_[0] + q);
        count += zero_unless(is_same, broadcast<Pack>(1));
        sum += zero_unless(is_same, other);
        squares += zero_unless(is_same, other * other);
      }
      const Pack mean = sum / count;
      store_pack(guide_ + i, mean);
      store_pack(before_[1] + i, max(squares / count - mean * mean, 0));  // 0 for NaN, too
    });
    for_interior_packs([&](std::size_t i) {
      const Pack key = load_pack(key_ + i);
      Pack count = broadcast<Pack>(1), sum = load_pack(before_[1] + i);
      for (const std::ptrdiff_t offset : offsets) {
        const std::size_t q = i + static_cast<std::size_t>(offset);
        const PackMask is_same = key == load_pack(key_ + q);
        count += zero_unless(is_same, broadcast<Pack>(1));
        sum += zero_unless(is_same, load_pack(before_[1] + q));
      }
      store_pack(variance_ + i, sum / count);
    });
  }

  /// Runs one filter pass over the interior pixels: weighted means over 3 x 3 taps that are 2^pass
  /// pixels apart.
  void smooth(int pass) {
    const auto offsets = neighbours(1 << pass);
    const float depth_scale = 1 / static_cast<float>(1 << pass);  // 1 / distance of the taps
    // Each pass is assumed to halve the standard deviation of the noise.
    const float variance_factor = kDeviations * kDeviations / static_cast<float>(1 << (2 * pass));
    for_rows([&](int y) {
      const std::size_t first = row_begin(y);
      for (std::size_t i = first; i < first + static_cast<std::size_t>(width_); i += kLanes)
        smooth_pack(i, offsets, depth_scale, variance_factor);
    });
    std::swap(light_, next_);
    std::swap(guide_, next_guide_);
  }
  /// Sets `next_` and `next_guide_` for a pack: its smoothed light, or its light where it is not
  /// interior, and the brightness of the smoothed light. `variance_factor`: (change of
  /// brightness)^2 / variance that halves a weight.
  void smooth_pack(std::size_t i, const std::array<std::ptrdiff_t, 8>& offsets, float depth_scale,
                   float variance_factor) {
    // Weights relative to the centre's, before edges reduce them.
    constexpr std::array<float, 8> kKernel = {0.25f, 0.5f, 0.25f, 0.5f, 0.5f, 0.25f, 0.5f, 0.25f};
    const Pack key = load_pack(key_ + i);
    const PackMask is_interior = key > 0;
    const Pack3 light = load_pack3(light_, i), normal = load_pack3(normal_, i),
                same_light = {light.x + 0.0f, light.y + 0.0f, light.z + 0.0f};  // -0 becomes 0
    if (!any(is_interior)) {
      store_pack3(next_, i, same_light);
      return;
    }
    const Pack depth = load_pack(depth_ + i), guide = load_pack(guide_ + i),
               inv_depth_range = load_pack(inv_depth_range_ + i) * depth_scale,
               noise = load_pack(variance_ + i) * variance_factor + 1e-6f;  // never 0
    Pack total = broadcast<Pack>(1);
    Pack3 sum = light;
    for (std::size_t k = 0; k < offsets.size(); ++k) {
      const std::size_t q = i + static_cast<std::size_t>(offsets[k]);
      const Pack cos = positive_part(dot(normal, load_pack3(normal_, q)));
      const Pack c4 = cos * cos * cos * cos, c16 = c4 * c4 * c4 * c4;
      const Pack depth_weight =
          positive_part(1 - abs(load_pack(depth_ + q) - depth) * inv_depth_range);
      const Pack change = load_pack(guide_ + q) - guide;
      // The normals' weight is cosine^32, the brightness's is 1 / (1 + change^2 / noise).
      const Pack tap_weight =
          kKernel[k] * (c16 * c16) * depth_weight * noise / (noise + change * change);
      // Light of the margin may be any value, even NaN.
      const PackMask is_same = key == load_pack(key_ + q);
      sum = sum + zero_unless(is_same, load_pack3(light_, q) * tap_weight);
      total += zero_unless(is_same, tap_weight);
    }
    const Pack3 mean = select(is_interior, sum / total, same_light);
    store_pack3(next_, i, mean);
    store_pack(next_guide_ + i, brightness(mean));
  }

  /// Sets `low_` and `high_` to bounds for the pixels of a pack, which are not interior or lie on a
  /// silhouette: the extremes of the light at most two pixels away that is free of noise, because
  /// it has been smoothed or nothing is hit, times the extremes of albedo in 3 x 3 pixels.
  void find_bounds(std::size_t i) {
    const Pack unbounded = broadcast<Pack>(kUnbounded);
    Pack3 low{unbounded, unbounded, unbounded}, high = -low;
    for (std::ptrdiff_t dy = -2; dy <= 2; ++dy)
      for (std::ptrdiff_t dx = -2; dx <= 2; ++dx) {
        const std::size_t q = i + static_cast<std::size_t>(dy * stride_ + dx);
        const Pack key = load_pack(key_ + q);
        const PackMask is_smooth = key == key;
        const Pack3 light = load_pack3(light_, q);
        low = select(is_smooth, min(light, low), low);
        high = select(is_smooth, max(light, high), high);
      }
    Pack3 low_albedo = load_pack3(albedo_, i), high_albedo = low_albedo;
    for (const std::ptrdiff_t offset : neighbours(1)) {
      const Pack3 albedo = load_pack3(albedo_, i + static_cast<std::size_t>(offset));
      low_albedo = min(albedo, low_albedo);
      high_albedo = max(albedo, high_albedo);
    }
    store_pack3(low_, i, low_albedo * low);
    store_pack3(high_, i, high_albedo * high);
  }

  /// Averages the light of a silhouette pixel's own surface, over nearby pixels that are not on a
  /// silhouette.
  std::optional<std::array<float, 3>> mean_own_side(std::size_t i, int x, int y) const {
    return mean_near(x, y, [&](std::size_t q, int u, int v) {
      const bool is_same_depth = std::fabs(depth_[i] - depth_[q]) <= kDepthJump * depth_[i];
      return id_[q] == id_[i] && !std::isnan(key_[q]) && is_same_depth && !is_silhouette(u, v);
    });
  }

  /// Clamps a value of a pixel that is not interior to the bounds that find_bounds() has set.
  float clamp_to_bounds(std::size_t i, std::size_t c, float value) const {
    const bool is_bounded = id_[i] > 0 && low_[c][i] <= high_[c][i];
    return is_bounded ? std::clamp(value, low_[c][i], high_[c][i]) : value;
  }

  /// Sets `next_` to the filtered colour of the surface at each pixel's centre. Interior pixels
  /// have their own smoothed light, and pixels on silhouettes the mean light of the same surface
  /// nearby. All others, and silhouettes without such a mean, have their sampled colour, clamped to
  /// the bounds.
  void make_colors() {
    // These planes are free here.
    low_ = normal_;
    high_ = {guide_, next_guide_, variance_};
    for_rows([&](int y) {
      for (int k = 0; k < packs_; ++k) {
        const std::size_t i = row_begin(y) + static_cast<std::size_t>(k * kLanes);
        const Pack key = load_pack(key_ + i);
        store_pack3(next_, i, load_pack3(light_, i) * load_pack3(albedo_, i));
        const std::uint32_t sampled = ~Lanes<Pack>::bits(key > 0) & picture_lanes(k);
        if (any(key != key) || silhouettes(y, k) != 0) find_bounds(i);
        for (std::uint32_t bits = sampled; bits != 0; bits &= bits - 1) {
          const int lane = countr_zero(bits);
          set_sampled_color(i + static_cast<std::size_t>(lane), k * kLanes + lane, y);
        }
      }
    });
  }
  /// Sets `next_` for a pixel that is not interior.
  void set_sampled_color(std::size_t i, int x, int y) {
    std::optional<std::array<float, 3>> own_light;
    if (is_silhouette(x, y)) own_light = mean_own_side(i, x, y);
    for (std::size_t c = 0; c < 3; ++c)
      next_[c][i] = own_light ? (*own_light)[c] * albedo_[c][i]
                              : clamp_to_bounds(i, c, film_.at(x, y, channels_[c]));
  }

  /// Sets `light_` on silhouettes to the residual: the sampled colour, clamped to the bounds, minus
  /// tent(next_), which blends the filtered colours of both sides.
  void find_residuals() {
    for_rows([&](int row) {
      for_silhouettes(row, [&](std::size_t i, int x, int y) {
        for (std::size_t c = 0; c < 3; ++c) {
          const float clamped = clamp_to_bounds(i, c, film_.at(x, y, channels_[c]));
          const float difference = clamped - tent(next_[c], x, y);
          light_[c][i] = std::isfinite(difference) ? difference : 0;
        }
      });
    });
  }

  /// Writes `next_` to the film. On silhouettes, where a pixel's few samples fall on either side by
  /// chance, writes tent(next_) plus the mean residual along the silhouette.
  void write() {
    for_rows([&](int row) {
      for (int k = 0; k < packs_; ++k) {
        // Where nothing is hit, `next_` is the film's colour.
        const std::size_t first = row_begin(row) + static_cast<std::size_t>(k * kLanes);
        const std::uint32_t sky = Lanes<Pack>::bits(load_pack(key_ + first) == kSkyKey);
        std::uint32_t bits = ~sky & picture_lanes(k) & ~std::uint32_t{silhouettes(row, k)};
        for (; bits != 0; bits &= bits - 1) {
          const int lane = countr_zero(bits);
          for (std::size_t c = 0; c < 3; ++c)
            film_.at(k * kLanes + lane, row, channels_[c]) =
                next_[c][first + static_cast<std::size_t>(lane)];
        }
      }
      for_silhouettes(row, [&](std::size_t i, int x, int y) { write_silhouette(i, x, y); });
    });
  }
  void write_silhouette(std::size_t i, int x, int y) {
    // The mean exists, because it includes the pixel itself.
    const auto residual = mean_near(
        x, y, [&](std::size_t q, int u, int v) { return id_[q] == id_[i] && is_silhouette(u, v); });
    for (std::size_t c = 0; c < 3; ++c) {
      float& value = film_.at(x, y, channels_[c]);
      const float smooth = clamp_to_bounds(i, c, tent(next_[c], x, y) + (*residual)[c]);
      if (std::isfinite(value) && std::isfinite(smooth)) value = smooth;
    }
  }

  /// Returns the mean of a plane's 3 x 3 values around a pixel, with the weights 1 2 1 along both
  /// axes. Outermost pixels are repeated.
  float tent(const float* plane, int x, int y) const {
    float sum = 0;
    for (int dy = -1; dy <= 1; ++dy) {
      const float* line = plane + row_begin(std::clamp(y + dy, 0, height_ - 1));
      const float across =
          line[std::max(x - 1, 0)] + 2 * line[x] + line[std::min(x + 1, width_ - 1)];
      sum += (dy == 0 ? 2.0f : 1.0f) * across;
    }
    return sum / 16;
  }

  Image& film_;
  int width_, height_;
  std::ptrdiff_t stride_;
  int packs_;                        ///< packs of a row
  std::array<int, 3> channels_;      ///< R, G and B in the film
  std::unique_ptr<float[]> values_;  ///< values of all planes
  std::vector<std::uint8_t> silhouettes_;
  // inv_depth_range_: 1 / (kDepthFalloff * depth). key_: see find_interior_pixels(). guide_,
  // variance_: mean and variance of the brightness. light_: colour / albedo, which find_residuals()
  // replaces. next_, next_guide_: result of the current step. before_: brightness and variance
  // before estimate_variance() averages them.
  Plane id_, depth_, inv_depth_range_, key_, guide_, next_guide_, variance_;
  Colors light_, next_, normal_, albedo_;
  std::array<Plane, 2> before_;
  Colors low_{}, high_{};  ///< bounds of the colour, where find_bounds() has set them
};

}  // namespace

void smooth_noise(Image& film) { Smoother(film).run(); }

std::uint64_t smooth_bytes(int width, int height) {
  return kPlanes * sizeof(float) * plane_size(width, height);
}

}  // namespace polymorph
