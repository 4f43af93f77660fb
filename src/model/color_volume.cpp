#include "model/color_volume.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "base/array3.h"
#include "base/box.h"
#include "base/parallel.h"
#include "base/result.h"
#include "image/texture.h"
#include "kernels/simd_math.h"
#include "mesh/sample_surface.h"

namespace polymorph {
namespace {

constexpr std::size_t kSamples = 1 << 16;  ///< points on the model's surface
constexpr int kCells = 64;                 ///< number of cell edges in the box's diagonal
/// Standard deviations, in cells, and weights of the three Gaussians.
constexpr float kNarrowDeviation = 0.015f * kCells;
constexpr std::array<float, 3> kDeviations = {kNarrowDeviation, 3 * kNarrowDeviation,
                                              9 * kNarrowDeviation};
constexpr std::array<float, 3> kGaussianWeights = {1, 1e-3f, 1e-6f};

/// Four floats: red, green and blue of a sum of weighted colours, and the sum of the weights.
typedef float WeightedColor __attribute__((vector_size(16)));
constexpr int kWeight = 3;  ///< index of the weight
WeightedColor weighted(Vec3 color, float weight) {
  return WeightedColor{color.x, color.y, color.z, 1} * weight;
}
Vec3 color_of(WeightedColor sum) { return {sum[0], sum[1], sum[2]}; }

/// The cell around a point, clamped to the grid, and the trilinear weights of its eight corners.
struct CellCorners {
  std::size_t index[8];
  float weight[8];

  CellCorners(const Grid& grid, Vec3 p) {
    int low[3];
    float t[3];
    const Vec3 q = (p - grid.origin) / grid.cell;
    const float coordinates[3] = {q.x, q.y, q.z};
    const int points[3] = {grid.points.x, grid.points.y, grid.points.z};
    for (int axis = 0; axis < 3; ++axis) {
      const float clamped =
          std::clamp(coordinates[axis], 0.0f, static_cast<float>(points[axis] - 1));
      low[axis] = std::min(static_cast<int>(clamped), points[axis] - 2);
      t[axis] = clamped - static_cast<float>(low[axis]);
    }
    for (int i = 0; i < 8; ++i) {
      const int x = i & 1, y = i >> 1 & 1, z = i >> 2;
      index[i] = array3_index(grid.points, low[0] + x, low[1] + y, low[2] + z);
      weight[i] = (x ? t[0] : 1 - t[0]) * (y ? t[1] : 1 - t[1]) * (z ? t[2] : 1 - t[2]);
    }
  }
};

/// Looks up the texture times the material's colour at a sample, without shading.
Vec3 sample_color(const Model& model, const SurfaceSample& sample) {
  const Material& material = model.materials[model.triangle_materials[sample.triangle]];
  if (material.texture < 0 || model.corner_uvs.empty()) return material.color;
  const auto& v = model.triangles[sample.triangle].v;
  const Vec3 a = model.points[v[0]], ab = model.points[v[1]] - a, ac = model.points[v[2]] - a,
             ap = sample.point - a;
  const float bb = dot(ab, ab), bc = dot(ab, ac), cc = dot(ac, ac), pb = dot(ap, ab),
              pc = dot(ap, ac), determinant = bb * cc - bc * bc;
  if (!(determinant > 0)) return material.color;
  // Barycentric weights of corners b and c.
  const float s = (cc * pb - bc * pc) / determinant, t = (bb * pc - bc * pb) / determinant;
  const Vec2* uv = &model.corner_uvs[std::size_t{sample.triangle} * 3];
  const auto texture = static_cast<std::size_t>(material.texture);
  return material.color *
         sample_texture(*model.textures[texture], uv[0] * (1 - s - t) + uv[1] * s + uv[2] * t);
}

/// Distributes the colours of samples to the grid points around them, by trilinear weights. Samples
/// of hidden faces are left out.
std::vector<WeightedColor> splat_samples(const Model& model, std::span<const FaceClass> classes,
                                         const Grid& grid) {
  const std::vector<SurfaceSample> samples = sample_surface(model, kSamples);
  std::vector<Vec3> colors(samples.size());
  parallel_for(
      static_cast<std::int64_t>(samples.size()),
      [&](std::int64_t i) {
        const auto k = static_cast<std::size_t>(i);
        colors[k] = sample_color(model, samples[k]);
      },
      /*grain=*/1024);
  std::vector<WeightedColor> sums(array3_count(grid.points));
  for (std::size_t k = 0; k < samples.size(); ++k) {
    if (classes[samples[k].triangle] == FaceClass::kHidden) continue;
    const CellCorners corners(grid, samples[k].point);
    for (int i = 0; i < 8; ++i) {
      sums[corners.index[i]] += weighted(colors[k], corners.weight[i]);
    }
  }
  return sums;
}

/// Applies a Gaussian blur along each axis in turn; `deviation` in cells. The Gaussian is cut off
/// at three deviations.
std::vector<WeightedColor> blur(std::vector<WeightedColor> v, Int3 points, float deviation) {
  const int radius = static_cast<int>(std::ceil(3 * deviation));
  std::vector<float> weights;
  for (int i = 0; i <= radius; ++i) {
    const float t = static_cast<float>(i) / deviation;
    constexpr float kHalfLog2E = 0.72134752f;  // exp(-t^2 / 2) = 2^(-kHalfLog2E t^2)
    weights.push_back(exp2(-kHalfLog2E * t * t));
  }
  const std::array<std::int64_t, 3> n = {points.x, points.y, points.z};
  const std::array<std::int64_t, 3> steps = {1, n[0], n[0] * n[1]};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t step = steps[axis];
    const auto count = static_cast<int>(n[axis]);
    parallel_ranges(static_cast<std::int64_t>(v.size()) / count, /*grain=*/32,
                    [&](std::int64_t begin, std::int64_t end) {
                      std::vector<WeightedColor> original(static_cast<std::size_t>(count));
                      for (std::int64_t line = begin; line < end; ++line) {
                        // Of the lines along the axis, `step` consecutive ones begin side by side;
                        // the next ones begin step * count elements further on.
                        WeightedColor* const first =
                            &v[static_cast<std::size_t>(line / step * step * count + line % step)];
                        // Most of the box is empty, so process only the range between a line's
                        // outermost samples.
                        int low = count, high = -1;
                        for (int i = 0; i < count; ++i) {
                          original[static_cast<std::size_t>(i)] = first[i * step];
                          if (!(first[i * step][kWeight] > 0)) continue;
                          low = std::min(low, i);
                          high = i;
                        }
                        for (int i = 0; high >= 0 && i < count; ++i) {
                          WeightedColor sum{};
                          for (int k = std::max(i - radius, low); k <= std::min(i + radius, high);
                               ++k)
                            sum += original[static_cast<std::size_t>(k)] *
                                   weights[static_cast<std::size_t>(std::abs(k - i))];
                          first[i * step] = sum;
                        }
                      }
                    });
  }
  return v;
}

}  // namespace

Vec3 ColorVolume::at(Vec3 p) const {
  const CellCorners corners(grid, p);
  Vec3 sum;
  for (int i = 0; i < 8; ++i) sum = sum + colors[corners.index[i]] * corners.weight[i];
  return sum;
}

bool is_one_color(const Model& model) {
  const Material& first = model.materials[model.triangle_materials.front()];
  return std::all_of(model.triangle_materials.begin(), model.triangle_materials.end(),
                     [&](std::uint32_t m) {
                       const Material& material = model.materials[m];
                       return material.texture < 0 && material.color == first.color;
                     });
}

ColorVolume make_color_volume(const Model& model, std::span<const FaceClass> classes) {
  PM_CHECK(classes.size() == model.triangles.size());
  constexpr int kMargin = 3;  // cells
  const Box box = model.box();
  ColorVolume volume;
  volume.grid.cell = box.diagonal() / kCells;
  volume.grid.origin = box.low - Vec3{kMargin, kMargin, kMargin} * volume.grid.cell;
  const auto count_points = [&](float extent) {
    return static_cast<int>(std::ceil(extent / volume.grid.cell)) + 2 * kMargin + 1;
  };
  const Vec3 size = box.size();
  volume.grid.points = {count_points(size.x), count_points(size.y), count_points(size.z)};
  std::vector<WeightedColor> sums(array3_count(volume.grid.points));
  const std::vector<WeightedColor> samples = splat_samples(model, classes, volume.grid);
  WeightedColor total{};
  for (const WeightedColor& sample : samples) total += sample;
  for (std::size_t k = 0; k < kDeviations.size(); ++k) {
    const std::vector<WeightedColor> blurred = blur(samples, volume.grid.points, kDeviations[k]);
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += blurred[i] * kGaussianWeights[k];
  }
  // The overall mean has a tiny weight, so it decides only where no Gaussian reaches the surface.
  constexpr float kEpsilon = 1e-9f;
  const Vec3 mean =
      total[kWeight] > 0 ? color_of(total) / total[kWeight] : model.materials.front().color;
  volume.colors.reserve(sums.size());
  for (const WeightedColor& sum : sums)
    volume.colors.push_back((color_of(sum) + mean * kEpsilon) / (sum[kWeight] + kEpsilon));
  return volume;
}

}  // namespace polymorph
