#include "arrays.h"

#include <nanobind/stl/string.h>

#include "base/exact_math.h"
#include "image/coverage.h"
#include "image/srgb.h"
#include "kernels/field_kinds.h"

namespace nb = nanobind;

namespace polymorph {
namespace {

nb::object to_point_array(const std::vector<Vec3>& points) {
  std::vector<float> values;
  values.reserve(3 * points.size());
  for (const Vec3 p : points) values.insert(values.end(), {p.x, p.y, p.z});
  return to_array(std::move(values), {points.size(), 3});
}

}  // namespace

std::vector<Vec3> to_points(const Rows<3>& rows) {
  std::vector<Vec3> points(rows.shape(0));
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i] = {rows.data()[3 * i], rows.data()[3 * i + 1], rows.data()[3 * i + 2]};
  return points;
}

MemoryMesh to_memory_mesh(const Rows<3>& vertices, const Indices& corners, const Indices& sizes,
                          const Rows<3>& colors) {
  const auto to_vector = [](const auto& values) {
    return std::vector(values.data(), values.data() + values.size());
  };
  return {to_points(vertices), to_vector(corners), to_vector(sizes), to_vector(colors)};
}

nb::object to_color_array(const Image& image, bool bytes, float stops) {
  const int channels[] = {image.find_channel("R"), image.find_channel("G"), image.find_channel("B"),
                          image.find_channel("A")};
  const std::size_t count = image.channel_count(), pixels = image.pixels.size() / count;
  const auto at = [&](std::size_t pixel, int c) {
    return image.pixels[pixel * count + static_cast<std::size_t>(channels[c])];
  };
  const std::vector<std::size_t> shape{static_cast<std::size_t>(image.height),
                                       static_cast<std::size_t>(image.width), 4};
  if (!bytes) {
    std::vector<float> values;
    values.reserve(4 * pixels);
    for (std::size_t i = 0; i < pixels; ++i)
      for (int c = 0; c < 4; ++c) values.push_back(at(i, c));
    return to_array(std::move(values), shape);
  }
  const SrgbQuantizer& quantizer = SrgbQuantizer::instance();
  const auto gain = static_cast<float>(exact::exp2(static_cast<double>(stops)));
  std::vector<std::uint8_t> values;
  values.reserve(4 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const float alpha = clamp_coverage(at(i, 3));
    const float scale = alpha > 0 ? gain / alpha : 0.0f;
    for (int c = 0; c < 3; ++c) values.push_back(quantizer(at(i, c) * scale));
    values.push_back(static_cast<std::uint8_t>(alpha * 255.0f + 0.5f));
  }
  return to_array(std::move(values), shape);
}

std::vector<Ball> to_balls(const Rows<3>& centers, const Column& a, const Column& w,
                           const Rows<9>& shapes) {
  const std::vector<Vec3> points = to_points(centers);
  std::vector<Ball> balls(points.size());
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const float* s = shapes.data() + 9 * i;  // a symmetric 3 x 3 matrix
    balls[i].center = points[i];
    balls[i].a = a.data()[i];
    balls[i].w = w.data()[i];
    balls[i].shape = {.xx = s[0], .yy = s[4], .zz = s[8], .xy = s[1], .xz = s[2], .yz = s[5]};
  }
  return balls;
}

nb::dict to_dict(const LeveledBalls& set, FieldKind kind) {
  const std::vector<Ball>& balls = set.balls;
  std::vector<Vec3> centers;
  std::vector<float> a, w, shapes;
  for (const Ball& ball : balls) {
    const Sym3& s = ball.shape;
    centers.push_back(ball.center);
    a.push_back(ball.a);
    w.push_back(ball.w);
    shapes.insert(shapes.end(), {s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz});
  }
  nb::dict out;
  out["centers"] = to_point_array(centers);
  out["a"] = to_array(std::move(a), {balls.size()});
  out["w"] = to_array(std::move(w), {balls.size()});
  out["shapes"] = to_array(std::move(shapes), {balls.size(), 3, 3});
  out["level"] = to_array(set.levels, {balls.size()});
  out["kind"] = std::string(field_name(kind));
  return out;
}

nb::dict to_dict(const Mesh& mesh) {
  std::vector<std::uint32_t> triangles;
  for (const Triangle& t : mesh.triangles)
    triangles.insert(triangles.end(), {t.v[0], t.v[1], t.v[2]});
  nb::dict out;
  out["positions"] = to_point_array(mesh.positions);
  out["normals"] = to_point_array(mesh.normals);
  out["triangles"] = to_array(std::move(triangles), {mesh.triangles.size(), 3});
  return out;
}

nb::dict to_dict(const MorphPlan& plan) {
  std::vector<std::uint32_t> pairs;
  std::vector<float> shares;
  std::vector<double> masses;
  for (const Pair& pair : plan.pairs) {
    pairs.insert(pairs.end(), {pair.from, pair.to});
    shares.insert(shares.end(), {pair.from_share, pair.to_share});
    masses.push_back(pair.mass);
  }
  const auto balls = [&](const std::vector<Ball>& set) {
    return to_dict(LeveledBalls{set, std::vector<float>(set.size(), 1)}, plan.kind);
  };
  nb::dict out;
  out["source_balls"] = balls(plan.from);
  out["target_balls"] = balls(plan.to);
  out["pairs"] = to_array(std::move(pairs), {plan.pairs.size(), 2});
  out["shares"] = to_array(std::move(shares), {plan.pairs.size(), 2});
  out["masses"] = to_array(std::move(masses), {plan.pairs.size()});
  return out;
}

}  // namespace polymorph
