#include "model/shapes.h"

#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <vector>

#include "base/exact_math.h"
#include "base/text.h"
#include "kernels/linear.h"
#include "mesh/normals.h"
#include "scene/scene.h"

namespace polymorph {
namespace {

constexpr double kPi = std::numbers::pi;

struct ShapeCorner {
  std::uint32_t point;  ///< index into Model::points
  Vec3 normal;
  Vec2 uv;
};

void add_triangle(Model& model, const ShapeCorner& a, const ShapeCorner& b, const ShapeCorner& c) {
  model.triangles.push_back({{a.point, b.point, c.point}});
  for (const ShapeCorner& corner : {a, b, c}) {
    model.corner_normals.push_back(corner.normal);
    model.corner_uvs.push_back(corner.uv);
  }
}

void add_quad(Model& model, const ShapeCorner& a, const ShapeCorner& b, const ShapeCorner& c,
              const ShapeCorner& d) {
  add_triangle(model, a, b, c);
  add_triangle(model, a, c, d);
}

/// Points indexed by an integer key, so that adjacent patches share their border points.
class PointSet {
 public:
  explicit PointSet(Model& model) : model_(model) {}
  std::uint32_t add(const std::array<int, 3>& key, Vec3 position) {
    const auto [it, added] =
        index_.try_emplace(key, static_cast<std::uint32_t>(model_.points.size()));
    if (added) model_.points.push_back(position);
    return it->second;
  }

 private:
  Model& model_;
  std::map<std::array<int, 3>, std::uint32_t> index_;
};

/// Adds the six sides of the cube [-1, 1]^3 as n x n quads; `corner(key, p, normal, uv)` makes each
/// corner. `key` is n p, whose components are whole numbers.
void add_cube_sides(
    Model& model, int n,
    const std::function<ShapeCorner(std::array<int, 3>, Vec3d, Vec3d, Vec2)>& corner) {
  for (int side = 0; side < 6; ++side) {
    const int axis = side / 2, sign = side % 2 ? 1 : -1;
    // Axes u, v of the side with u x v pointing outward. On the four upright sides, v points up. On
    // the top it points to -z, on the bottom to +z, so that u is +x on both.
    std::array<double, 3> outward{}, u{}, v{};
    outward[static_cast<std::size_t>(axis)] = sign;
    v[axis == 1 ? 2 : 1] = axis == 1 ? -sign : 1;
    u = {v[1] * outward[2] - v[2] * outward[1], v[2] * outward[0] - v[0] * outward[2],
         v[0] * outward[1] - v[1] * outward[0]};
    const auto corner_at = [&](int i, int j) {
      std::array<int, 3> key{};
      std::array<double, 3> p{};
      for (std::size_t k = 0; k < 3; ++k) {
        key[k] =
            static_cast<int>(std::lround(outward[k] * n + u[k] * (2 * i - n) + v[k] * (2 * j - n)));
        p[k] = static_cast<double>(key[k]) / n;
      }
      return corner(key, {p[0], p[1], p[2]}, {outward[0], outward[1], outward[2]},
                    {static_cast<float>(i) / static_cast<float>(n),
                     static_cast<float>(j) / static_cast<float>(n)});
    };
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i)
        add_quad(model, corner_at(i, j), corner_at(i + 1, j), corner_at(i + 1, j + 1),
                 corner_at(i, j + 1));
  }
}

Model make_cube() {
  Model model;
  PointSet points(model);
  add_cube_sides(model, /*n=*/20, [&](std::array<int, 3> key, Vec3d p, Vec3d normal, Vec2 uv) {
    return ShapeCorner{points.add(key, to_float(p + Vec3d(0, 1, 0))), to_float(normal), uv};
  });
  return model;
}

// Shifts u across the seam of longitude, so that the corners of a triangle stay within half a
// revolution of each other.
void close_seams(Model& model) {
  for (std::size_t t = 0; t < model.triangles.size(); ++t) {
    Vec2* uv = &model.corner_uvs[3 * t];
    const float high = std::max({uv[0].x, uv[1].x, uv[2].x});
    for (int k = 0; k < 3; ++k)
      if (high - uv[k].x > 0.5f) uv[k].x += 1;
    for (int k = 0; k < 3; ++k) {
      const Vec3 n = model.corner_normals[3 * t + static_cast<std::size_t>(k)];
      if (n.x == 0 && n.z == 0)
        uv[k].x = 0.5f * (uv[(k + 1) % 3].x + uv[(k + 2) % 3].x);  // a pole has no longitude
    }
  }
}

// Projects the sides of a cube, as grids of rows x rows quads, onto a sphere. Unlike a grid of
// longitude and latitude, this gives nearly equal triangles and no degenerate poles. tan()
// equalizes the angles between grid lines.
void add_sphere(Model& model, Vec3d center, double radius, int rows) {
  PointSet points(model);
  add_cube_sides(model, rows, [&](std::array<int, 3> key, Vec3d p, Vec3d, Vec2) {
    const Vec3d n = normalized(
        Vec3d(exact::tan(p.x * kPi / 4), exact::tan(p.y * kPi / 4), exact::tan(p.z * kPi / 4)));
    const double longitude = exact::atan2(n.x, n.z) / (2 * kPi) + 0.5;
    return ShapeCorner{
        points.add(key, to_float(center + n * radius)),
        to_float(n),
        {static_cast<float>(longitude), static_cast<float>(exact::asin(n.y) / kPi + 0.5)}};
  });
}

Model make_sphere() {
  Model model;
  add_sphere(model, /*center=*/{0, 1, 0}, /*radius=*/1, /*rows=*/24);
  close_seams(model);
  return model;
}

// Small drops distributed evenly in a ball: drop i lies in the i-th of 48 shells of equal volume.
// `up`, the vertical component of its direction from the ball's centre, falls from 1 to -1 thirteen
// times over all drops, and its azimuth advances by 0.618034 of a revolution, the golden ratio
// minus 1.
Model make_drops() {
  constexpr int kDrops = 48;
  constexpr double kRadius = 0.05, kMaxOffset = 1 - kRadius;
  Model model;
  for (int i = 0; i < kDrops; ++i) {
    const double fraction = (i + 0.5) / kDrops;
    const double up = 1 - 2 * std::fmod(fraction * 13, 1.0),
                 azimuth = 2 * kPi * std::fmod(i * 0.618034, 1.0);
    const double horizontal = std::sqrt(1 - up * up), r = kMaxOffset * cube_root(fraction);
    add_sphere(model,
               Vec3d(horizontal * exact::cos(azimuth) * r, 1 + up * r,
                     horizontal * exact::sin(azimuth) * r),
               kRadius, /*rows=*/4);
  }
  close_seams(model);
  return model;
}

Model make_torus() {
  constexpr int kSegments = 96, kTubeSegments = 40;
  constexpr double kRingRadius = 1, kTubeRadius = 0.4;
  Model model;
  // Offset from the tube's centre line; with radius 1, the normal.
  const auto tube_offset = [&](int i, int j, double tube_radius) {
    const double a = 2 * kPi * (i % kSegments) / kSegments,
                 b = 2 * kPi * (j % kTubeSegments) / kTubeSegments;
    const double outward = exact::cos(b) * tube_radius;
    return Vec3d(exact::sin(a) * outward, exact::sin(b) * tube_radius, exact::cos(a) * outward);
  };
  for (int i = 0; i < kSegments; ++i)
    for (int j = 0; j < kTubeSegments; ++j) {
      const double a = 2 * kPi * i / kSegments;
      const Vec3d ring_center(exact::sin(a) * kRingRadius, kTubeRadius,
                              exact::cos(a) * kRingRadius);
      model.points.push_back(to_float(ring_center + tube_offset(i, j, kTubeRadius)));
    }
  const auto corner_at = [&](int i, int j) {
    return ShapeCorner{
        static_cast<std::uint32_t>((i % kSegments) * kTubeSegments + j % kTubeSegments),
        to_float(tube_offset(i, j, 1)),
        {static_cast<float>(i) / kSegments, static_cast<float>(j) / kTubeSegments}};
  };
  for (int i = 0; i < kSegments; ++i)
    for (int j = 0; j < kTubeSegments; ++j)
      add_quad(model, corner_at(i, j), corner_at(i + 1, j), corner_at(i + 1, j + 1),
               corner_at(i, j + 1));
  return model;
}

/// A point of the puddle's profile: radius, height, and the two components of the normal.
struct ProfilePoint {
  double r, y, outward, up;
};

Model make_puddle() {
  constexpr int kSegments = 96, kRimSegments = 8, kRings = 5;
  constexpr double kRadius = 1.3, kHeight = 0.12, kRimRadius = kHeight / 2;
  // The profile leads from the bottom's centre outward, around the rim, to the top's centre. The
  // centres themselves are points 0 and 1.
  std::vector<ProfilePoint> profile;
  for (int i = 1; i < kRings; ++i)
    profile.push_back({(kRadius - kRimRadius) * i / kRings, 0, 0, -1});
  for (int i = 0; i <= kRimSegments; ++i) {
    const double a = kPi * i / kRimSegments - kPi / 2;
    profile.push_back({kRadius - kRimRadius + kRimRadius * exact::cos(a),
                       kRimRadius + kRimRadius * exact::sin(a), exact::cos(a), exact::sin(a)});
  }
  for (int i = kRings - 1; i > 0; --i)
    profile.push_back({(kRadius - kRimRadius) * i / kRings, kHeight, 0, 1});
  Model model;
  model.points = {{0, 0, 0}, {0, static_cast<float>(kHeight), 0}};
  const int rows = static_cast<int>(profile.size());
  const auto rotate_about_y = [](int i, double outward, double up) {
    const double a = 2 * kPi * (i % kSegments) / kSegments;
    return to_float(Vec3d(exact::sin(a) * outward, up, exact::cos(a) * outward));
  };
  const auto planar_uv = [](Vec3 p) {
    return Vec2{0.5f + p.x / (2 * static_cast<float>(kRadius)),
                0.5f - p.z / (2 * static_cast<float>(kRadius))};
  };
  for (int i = 0; i < kSegments; ++i)
    for (const ProfilePoint& p : profile) model.points.push_back(rotate_about_y(i, p.r, p.y));
  const auto corner_at = [&](int i, int row) {
    const auto index = static_cast<std::uint32_t>(2 + (i % kSegments) * rows + row);
    const ProfilePoint& p = profile[static_cast<std::size_t>(row)];
    return ShapeCorner{index, rotate_about_y(i, p.outward, p.up), planar_uv(model.points[index])};
  };
  const ShapeCorner bottom{0, {0, -1, 0}, {0.5f, 0.5f}}, top{1, {0, 1, 0}, {0.5f, 0.5f}};
  for (int i = 0; i < kSegments; ++i) {
    add_triangle(model, bottom, corner_at(i + 1, 0), corner_at(i, 0));
    for (int row = 0; row + 1 < rows; ++row)
      add_quad(model, corner_at(i, row), corner_at(i + 1, row), corner_at(i + 1, row + 1),
               corner_at(i, row + 1));
    add_triangle(model, top, corner_at(i, rows - 1), corner_at(i + 1, rows - 1));
  }
  return model;
}

}  // namespace

Result<Model> make_shape(const std::string& name) {
  Model model;
  if (name == "sphere") {
    model = make_sphere();
  } else if (name == "cube") {
    model = make_cube();
  } else if (name == "torus") {
    model = make_torus();
  } else if (name == "drops") {
    model = make_drops();
  } else if (name == "puddle") {
    model = make_puddle();
  } else {
    const auto nearest = nearest_word(name, kShapeNames);
    return make_error(ErrorCode::kInput, "unknown shape \"{}\" - {}use {}", name,
                      nearest ? fmt::format("did you mean \"{}\"? ", *nearest) : "",
                      join_quoted(kShapeNames));
  }
  model.name = name;
  model.label_names = {name};
  model.labels.assign(model.triangles.size(), 0);
  model.materials.emplace_back().name = name;
  model.triangle_materials.assign(model.triangles.size(), 0);
  return model;
}

}  // namespace polymorph
