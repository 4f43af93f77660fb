// Arrays between numpy and the rooms' types. The Python side has checked what comes in.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "image/image.h"
#include "kernels/mesh.h"
#include "kernels/types.h"
#include "morph/plan.h"
#include "scene/memory_models.h"

namespace polymorph {

/// Hands values to numpy, which owns them from then on.
template <class T>
nanobind::object array(std::vector<T> values, std::vector<std::size_t> shape) {
  namespace nb = nanobind;
  auto* kept = new std::vector<T>(std::move(values));
  nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, T>(kept->data(), shape.size(), shape.data(), owner));
}

/// Rows of N floats.
template <int N>
using Rows = nanobind::ndarray<const float, nanobind::shape<-1, N>, nanobind::c_contig,
                               nanobind::device::cpu>;
using Column =
    nanobind::ndarray<const float, nanobind::shape<-1>, nanobind::c_contig, nanobind::device::cpu>;

std::vector<Vec3> to_points(const Rows<3>& rows);

using Indices = nanobind::ndarray<const std::uint32_t, nanobind::shape<-1>, nanobind::c_contig,
                                  nanobind::device::cpu>;

/// `corners`: indices of vertices, face after face; `sizes`: of each face; `colors`: one per
/// vertex, or none.
MemoryMesh to_memory_mesh(const Rows<3>& vertices, const Indices& corners, const Indices& sizes,
                          const Rows<3>& colors);

/// The colours of an image as rows of R, G, B, A: linear and premultiplied as they are, or
/// (`bytes`) as a PNG has them: sRGB, not premultiplied, brightened by `stops`.
nanobind::object color_array(const Image& image, bool bytes, float stops);

/// Balls of one or more actors, and the level that has been divided out of each.
struct LeveledBalls {
  std::vector<Ball> balls;
  std::vector<float> levels;
};
std::vector<Ball> to_balls(const Rows<3>& centers, const Column& a, const Column& w,
                           const Rows<9>& shapes);

nanobind::dict to_dict(const LeveledBalls& balls, FieldKind kind);
nanobind::dict to_dict(const Mesh& mesh);
nanobind::dict to_dict(const MorphPlan& plan);

}  // namespace polymorph
