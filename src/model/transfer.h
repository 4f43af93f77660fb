// Attribute transfer: gives a surface the materials and texture coordinates of a model near it.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <span>
#include <vector>

#include "mesh/closest.h"
#include "model/model.h"

namespace polymorph {

/// Returns the chart of the texture to which each triangle belongs, as a number per triangle.
/// Adjacent triangles belong to one chart if they have the same material, and the same texture
/// coordinates along their common edge.
std::vector<std::uint32_t> find_texture_charts(const Model& model);

/// A triangle that crosses a border of the model's charts or materials, with different colours or
/// materials on the border's two sides.
struct BorderTriangle {
  std::array<Vec3, 3> corners;  ///< points of the model, or near it
  ClosestPoint center_hit;      ///< the model's point closest to the mean of `corners`
};

/// Materials and texture coordinates of a surface, in the form that Model has them.
struct TransferredMaterials {
  static constexpr std::uint32_t kNoBorder = 0xffffffffu;
  std::vector<Vec2> corner_uvs;                   ///< 3 per triangle; empty if the model has none
  std::vector<std::uint32_t> triangle_materials;  ///< one per triangle, as in Model
  std::vector<BorderTriangle> borders;
  /// Index in `borders` per triangle, or kNoBorder; empty if there are no borders.
  std::vector<std::uint32_t> border_index;
};

/// A material of the model and texture coordinates.
struct TexturePoint {
  std::uint32_t material = 0;
  Vec2 uv;
};

/// Points, one per vertex of a surface, at which a model's attributes are looked up: the vertices
/// themselves or, if the surface has moved away from the model, the points to which they are mapped
/// back.
struct Origins {
  std::span<const Vec3> places;
  /// The model's closest point for each of `places`; empty if not yet computed.
  std::span<const ClosestPoint> closest = {};
};

/// Gives each corner of a triangle the texture coordinates of the model at the point closest to its
/// vertex's origin, and each triangle the material at its first corner. If the corners of a
/// triangle fall into several charts, or far apart in the texture, the triangle has the material at
/// its centroid, and the chart there is extrapolated to its corners, so that no texture is smeared
/// across a seam. The border between charts then runs along triangle edges; texture_point() finds
/// its exact course.
///
/// What a picture does not show is not looked up: a triangle's part is found when it is first asked
/// for. Const member functions may be called from many threads at once. The model, its query and
/// its charts are borrowed.
class MaterialTransfer {
 public:
  /// `charts`: find_texture_charts(). `triangles`: those of the surface.
  MaterialTransfer(const Model& model, const ClosestPointQuery& closest,
                   std::span<const std::uint32_t> charts, const Origins& origins,
                   std::span<const Triangle> triangles);

  bool has_uvs() const { return !model_.corner_uvs.empty(); }
  /// Tests whether the material is the same everywhere, without texture coordinates.
  bool is_uniform() const { return is_uniform_; }
  /// Returns the material and texture coordinates at a point of a triangle. `u` and `v` are the
  /// barycentric weights of its second and third corner.
  TexturePoint at(std::uint32_t triangle, float u, float v) const;
  /// Looks up all triangles.
  TransferredMaterials all() const;

 private:
  /// Values that are computed when they are first asked for. Threads that ask for a value at the
  /// same time all compute it, as all find the same, and one of them keeps it. Memory of values
  /// that nobody asks for is not touched, so that the system need not provide it.
  template <class T>
  class LazyValues {
   public:
    LazyValues() = default;
    explicit LazyValues(std::size_t count)
        : slots_(static_cast<Slot*>(std::calloc(count, sizeof(Slot)))) {
      if (!slots_ && count > 0) throw std::bad_alloc();
    }
    bool is_known(std::size_t i) const {
      return std::atomic_ref(slots_[i].state).load(std::memory_order_acquire) == kKnown;
    }
    template <class Compute>
    T get(std::size_t i, const Compute& compute) const {
      Slot& slot = slots_[i];
      if (is_known(i)) return slot.value;
      const T value = compute();
      const std::atomic_ref state(slot.state);
      std::uint8_t expected = kUnknown;
      if (state.compare_exchange_strong(expected, kBusy)) {
        slot.value = value;
        state.store(kKnown, std::memory_order_release);
      }
      return value;
    }

   private:
    static constexpr std::uint8_t kUnknown = 0, kBusy = 1, kKnown = 2;
    struct Slot {
      T value;
      std::uint8_t state;  ///< kUnknown in new memory, whose bytes are 0
    };
    struct Free {
      void operator()(Slot* slots) const { std::free(slots); }
    };
    std::unique_ptr<Slot[], Free> slots_;
  };
  /// The model's point that is closest to a vertex's origin.
  struct Corner {
    ClosestPoint hit;
    Vec2 uv;
  };
  /// The attributes that a triangle takes from the model.
  struct Part {
    std::uint32_t material = 0;
    bool has_border = false;  ///< whether a BorderTriangle is to be asked
    std::array<Vec2, 3> uvs;  ///< texture coordinates of the corners
  };

  Corner corner(std::uint32_t vertex, const Corner* neighbour, Vec3 neighbour_place) const;
  std::array<Corner, 3> corners(const Triangle& triangle) const;
  /// Looks up a triangle. Sets `center_hit` (BorderTriangle) if it crosses a border.
  Part look_up(const Triangle& triangle, ClosestPoint& center_hit) const;

  const Model& model_;
  const ClosestPointQuery& closest_;
  std::span<const std::uint32_t> areas_;  ///< chart or, without texture, material per triangle
  bool is_uniform_ = false;               ///< if true, the members below are empty
  std::vector<Triangle> triangles_;
  std::vector<Vec3> places_;                 ///< Origins::places
  std::vector<ClosestPoint> known_closest_;  ///< Origins::closest
  LazyValues<Corner> corners_;               ///< one per vertex
  LazyValues<Part> parts_;                   ///< one per triangle
};

/// Non-owning view of the arrays that a texture lookup at a closest point needs. `corner_uvs` and
/// `triangle_materials` may be empty.
struct TexturedTriangles {
  std::span<const Vec3> points;
  std::span<const Triangle> triangles;
  std::span<const Vec2> corner_uvs;
  std::span<const std::uint32_t> triangle_materials;
};

/// Interpolates texture coordinates at barycentric weights of a triangle.
PM_HD inline Vec2 interpolate_uv(std::span<const Vec2> corner_uvs, std::uint32_t triangle,
                                 const TriangleWeights& w) {
  const Vec2* uv = &corner_uvs[3 * std::size_t{triangle}];
  return uv[0] * static_cast<float>(w.a) + uv[1] * static_cast<float>(w.b) +
         uv[2] * static_cast<float>(w.c);
}

/// Looks up the material and texture coordinates of the model at a closest point.
PM_HD inline TexturePoint texture_point(const TexturedTriangles& source, const ClosestPoint& hit) {
  TexturePoint point;
  if (!source.triangle_materials.empty()) point.material = source.triangle_materials[hit.triangle];
  if (source.corner_uvs.empty()) return point;
  const std::uint32_t* v = source.triangles[hit.triangle].v;
  point.uv = interpolate_uv(source.corner_uvs, hit.triangle,
                            closest_on_triangle(hit.point, source.points[v[0]], source.points[v[1]],
                                                source.points[v[2]]));
  return point;
}

/// Looks up the material and texture coordinates of the model at the point closest to a point of a
/// border triangle. `u` and `v` are the barycentric weights of its second and third corner.
/// `closest(point, neighbour, neighbour_hit)` finds the model's point closest to `point`, as
/// ClosestPointQuery::closest() does.
template <class Closest>
PM_HD TexturePoint texture_point(const TexturedTriangles& source, const BorderTriangle& border,
                                 float u, float v, const Closest& closest) {
  const Vec3 a = border.corners[0], b = border.corners[1], c = border.corners[2];
  return texture_point(
      source, closest(a * (1 - u - v) + b * u + c * v, (a + b + c) / 3.0f, border.center_hit));
}
/// Looks up a point of a border triangle in a Model, with the model's ClosestPointQuery.
TexturePoint texture_point(const Model& model, const ClosestPointQuery& closest,
                           const BorderTriangle& border, float u, float v);

}  // namespace polymorph
