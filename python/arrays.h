// Converts numpy arrays, which polymorph/_inputs.py has checked, to C++ types, and back.
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

/// Makes a numpy array of this shape that owns `values`.
template <class T>
nanobind::object to_array(std::vector<T> values, std::vector<std::size_t> shape) {
  namespace nb = nanobind;
  auto* owned = new std::vector<T>(std::move(values));
  nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, T>(owned->data(), shape.size(), shape.data(), owner));
}

/// Arrays of float32 with the shapes (n, N) and (n,), contiguous, in the CPU's memory.
template <int N>
using Rows = nanobind::ndarray<const float, nanobind::shape<-1, N>, nanobind::c_contig,
                               nanobind::device::cpu>;
using Column =
    nanobind::ndarray<const float, nanobind::shape<-1>, nanobind::c_contig, nanobind::device::cpu>;

std::vector<Vec3> to_points(const Rows<3>& rows);

using Indices = nanobind::ndarray<const std::uint32_t, nanobind::shape<-1>, nanobind::c_contig,
                                  nanobind::device::cpu>;

/// `corners`: vertex indices of all faces, one face after the other; `sizes`: number of corners of
/// each face; `colors`: one per vertex, or empty.
MemoryMesh to_memory_mesh(const Rows<3>& vertices, const Indices& corners, const Indices& sizes,
                          const Rows<3>& colors);

/// Returns the colours of an image, (height, width, 4): float32, linear and premultiplied as in the
/// image, or, with `bytes`, uint8 as in a PNG: sRGB, not premultiplied, R, G and B times 2^`stops`.
nanobind::object to_color_array(const Image& image, bool bytes, float stops);

/// Balls whose field is 1 at the surface. `levels`: for each ball, the field at the surface before
/// rescale_balls() (field/level.h).
struct LeveledBalls {
  std::vector<Ball> balls;
  std::vector<float> levels;
};
std::vector<Ball> to_balls(const Rows<3>& centers, const Column& a, const Column& w,
                           const Rows<9>& shapes);

/// Return the arguments of Balls, Mesh and Plan (polymorph/_records.py).
nanobind::dict to_dict(const LeveledBalls& balls, FieldKind kind);
nanobind::dict to_dict(const Mesh& mesh);
nanobind::dict to_dict(const MorphPlan& plan);

}  // namespace polymorph
