// Basic types used everywhere: vectors, balls, the sample grid, the triangle. C++17, compiled by
// g++ and nvcc alike. Lengths are in scene units, indices are uint32. In all comments, "the report"
// is J. Gilbert, Real Time Morphing of Polyhedra (2010).
#pragma once

#include <cmath>
#include <cstdint>

#include "host_device.h"

namespace polymorph {

struct Vec2 {
  float x = 0, y = 0;
};

struct Vec3 {
  float x = 0, y = 0, z = 0;
};

struct Int3 {
  int x = 0, y = 0, z = 0;
};

PM_HD constexpr Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
PM_HD constexpr Vec2 operator*(Vec2 a, float s) { return {a.x * s, a.y * s}; }
PM_HD constexpr bool operator==(Vec2 a, Vec2 b) { return a.x == b.x && a.y == b.y; }

PM_HD constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
PM_HD constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
PM_HD constexpr Vec3 operator*(Vec3 a, Vec3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
PM_HD constexpr Vec3 operator*(Vec3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
PM_HD constexpr Vec3 operator*(float s, Vec3 a) { return a * s; }
PM_HD constexpr Vec3 operator/(Vec3 a, float s) { return {a.x / s, a.y / s, a.z / s}; }
PM_HD constexpr Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
PM_HD constexpr bool operator==(Vec3 a, Vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

PM_HD constexpr float dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
PM_HD constexpr Vec3 cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
PM_HD inline float length(Vec3 a) { return std::sqrt(dot(a, a)); }
/// The unit vector along `a`; the zero vector stays zero.
PM_HD inline Vec3 normalized(Vec3 a) {
  const float n = length(a);
  return n > 0 ? a / n : Vec3{};
}
PM_HD constexpr float lerp(float a, float b, float t) { return a + (b - a) * t; }
PM_HD constexpr Vec3 lerp(Vec3 a, Vec3 b, float t) { return a + (b - a) * t; }
PM_HD constexpr Vec3 min(Vec3 a, Vec3 b) {
  return {a.x < b.x ? a.x : b.x, a.y < b.y ? a.y : b.y, a.z < b.z ? a.z : b.z};
}
PM_HD constexpr Vec3 max(Vec3 a, Vec3 b) {
  return {a.x > b.x ? a.x : b.x, a.y > b.y ? a.y : b.y, a.z > b.z ? a.z : b.z};
}

/// The function of the distance that a ball contributes to the field (docs/method.md, Field).
enum class FieldKind : std::uint8_t {
  kGaussian,       ///< exp(w - a r^2)  (Blinn 1982, Eq. 3.1 of the report)
  kInverseSquare,  ///< w / r^2         (the report's Algorithm 5.1; infinite support)
  kWyvill,         ///< w (1 - 22/9 q + 17/9 q^2 - 4/9 q^3), q = a r^2, 0 from q = 1 (Wyvill 1986)
};

/// The surface that is drawn through the samples.
enum class SurfaceMethod : std::uint8_t {
  kMarchingCubes,
  /// A cube at each inside point (the report's 2.1.2.1). Every face of a cube has its own vertices,
  /// so that the mesh is not connected.
  kMatrix,
};

/// Position of a vertex on a crossed edge.
enum class Placement : std::uint8_t {
  kRoot,      ///< the point of the edge at which the field is iso
  kMidpoint,  ///< the edge's middle: the report's marching cubes
};

/// A symmetric 3 x 3 matrix; the identity by default.
struct Sym3 {
  float xx = 1, yy = 1, zz = 1, xy = 0, xz = 0, yz = 0;
};
PM_HD constexpr bool operator==(const Sym3& s, const Sym3& t) {
  return s.xx == t.xx && s.yy == t.yy && s.zz == t.zz && s.xy == t.xy && s.xz == t.xz &&
         s.yz == t.yz;
}
/// Returns d^T s d.
PM_HD constexpr float quadratic(const Sym3& s, Vec3 d) {
  return s.xx * d.x * d.x + s.yy * d.y * d.y + s.zz * d.z * d.z +
         2 * (s.xy * d.x * d.y + s.xz * d.x * d.z + s.yz * d.y * d.z);
}
PM_HD constexpr float determinant(const Sym3& s) {
  return s.xx * (s.yy * s.zz - s.yz * s.yz) - s.xy * (s.xy * s.zz - s.yz * s.xz) +
         s.xz * (s.xy * s.yz - s.yy * s.xz);
}

/// A field source. The field is divided by the scene's threshold, so that the surface is at field =
/// 1 (or at ExtractSettings::iso); inside, the field is larger.
///   kGaussian:      contributes exp(w - a d^T shape d), d the offset from the centre; the
///                   surface of a single round ball is at r = sqrt(w / a).
///   kWyvill:        contributes w (1 - q)^2 (1 - 4/9 q), q = a d^T shape d, and 0 for q >= 1; a
///                   round ball has a = 1 / support^2.
///   kInverseSquare: contributes w / r^2; the surface of a single ball is at r = sqrt(w); `a`
///                   and `shape` are unused.
struct Ball {
  Vec3 center;
  float a = 1;  ///< 1 / length^2, > 0; for an ellipsoid the geometric mean of its axes' values
  float w = 0;  ///< strength; w < 0 lowers the field, but kGaussian only adds less: exp(w) > 0
  /// Positive definite, determinant 1: the identity is a round ball, anything else an ellipsoid of
  /// the same volume.
  Sym3 shape{};
};
PM_HD constexpr bool is_round(const Ball& ball) { return ball.shape == Sym3{}; }

/// Sample points of the field: point (x, y, z) lies at origin + cell * (x, y, z) and has index
/// x + points.x * (y + points.y * z). Cells are cubes.
struct Grid {
  Vec3 origin;
  float cell = 1;  ///< edge of a cell, > 0
  Int3 points;     ///< >= 2 along each axis
};

/// Position of a grid point: one multiplication and one addition, each rounded, on every backend.
PM_HD constexpr Vec3 grid_point(const Grid& grid, Int3 p) {
  return {grid.origin.x + grid.cell * static_cast<float>(p.x),
          grid.origin.y + grid.cell * static_cast<float>(p.y),
          grid.origin.z + grid.cell * static_cast<float>(p.z)};
}

/// Vertex indices, counter-clockwise seen from outside.
struct Triangle {
  std::uint32_t v[3] = {0, 0, 0};
};

}  // namespace polymorph
