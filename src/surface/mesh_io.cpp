#include "surface/mesh_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>

#include "base/file.h"
#include "surface/near_balls.h"

namespace polymorph {
namespace {

static_assert(std::endian::native == std::endian::little, "encode_ply writes memory as it is");

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Of the ball alone; 0 where it shows no surface.
float visible_radius(const Ball& ball, FieldKind kind) {
  if (kind == FieldKind::kInverseSquare) return std::sqrt(std::max(ball.w, 0.0f));
  if (kind == FieldKind::kGaussian) return std::sqrt(std::max(ball.w / ball.a, 0.0f));
  if (!(ball.w > 1)) return 0;
  float inside = 0, outside = 1 / std::sqrt(ball.a);
  for (int step = 0; step < 40; ++step) {
    const float middle = (inside + outside) / 2;
    (log_strength({{}, ball.a, ball.w, {}}, kind, {middle, 0, 0}) > 0 ? inside : outside) = middle;
  }
  return inside;
}

const char* field_name(FieldKind kind) {
  return kind == FieldKind::kGaussian        ? "gaussian"
         : kind == FieldKind::kInverseSquare ? "inverse_square"
                                             : "wyvill";
}

/// The ellipsoid of a ball that is not round.
std::string shape_text(const Ball& ball) {
  const Sym3& s = ball.shape;
  return is_round(ball) ? std::string()
                        : fmt::format(", \"shape\": [{}, {}, {}, {}, {}, {}]", s.xx, s.yy, s.zz,
                                      s.xy, s.xz, s.yz);
}

}  // namespace

std::string encode_obj(const Mesh& mesh, std::span<const MeshPart> parts) {
  std::string text = "# polymorph surface\n";
  auto out = std::back_inserter(text);
  for (const Vec3& p : mesh.positions) fmt::format_to(out, "v {} {} {}\n", p.x, p.y, p.z);
  for (const Vec3& n : mesh.normals) fmt::format_to(out, "vn {} {} {}\n", n.x, n.y, n.z);
  const bool flat = mesh.normals.empty();
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (; !parts.empty() && parts.front().first_triangle == i; parts = parts.subspan(1))
      fmt::format_to(out, "o {}\n", parts.front().name);
    const Triangle& t = mesh.triangles[i];
    if (flat)
      fmt::format_to(out, "f {} {} {}\n", t.v[0] + 1, t.v[1] + 1, t.v[2] + 1);
    else
      fmt::format_to(out, "f {0}//{0} {1}//{1} {2}//{2}\n", t.v[0] + 1, t.v[1] + 1, t.v[2] + 1);
  }
  return text;
}

std::string encode_ply(const Mesh& mesh, const MeshTags& tags) {
  const bool flat = mesh.normals.empty();
  std::string bytes = "ply\nformat binary_little_endian 1.0\ncomment polymorph surface\n";
  for (std::size_t i = 0; i < tags.label_names.size(); ++i)
    bytes += fmt::format("comment label {} {}\n", i, tags.label_names[i]);
  bytes += fmt::format(
      "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n{}{}"
      "element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
      mesh.positions.size(),
      flat ? "" : "property float nx\nproperty float ny\nproperty float nz\n",
      tags.labels.empty() ? "" : "property int label\n", mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    append(bytes, mesh.positions[i]);
    if (!flat) append(bytes, mesh.normals[i]);
    if (!tags.labels.empty()) append(bytes, tags.labels[i]);
  }
  for (const Triangle& t : mesh.triangles) {
    append(bytes, std::uint8_t{3});
    append(bytes, t);
  }
  return bytes;
}

std::string encode_balls(const std::vector<Ball>& balls, FieldKind kind) {
  std::string text = fmt::format("{{\n  \"field\": \"{}\",\n  \"balls\": [", field_name(kind));
  auto out = std::back_inserter(text);
  for (std::size_t i = 0; i < balls.size(); ++i)
    fmt::format_to(out,
                   "{}\n    {{\"center\": [{}, {}, {}], \"a\": {}, \"w\": {}, \"radius\": {}{}}}",
                   i ? "," : "", balls[i].center.x, balls[i].center.y, balls[i].center.z,
                   balls[i].a, balls[i].w, visible_radius(balls[i], kind), shape_text(balls[i]));
  text += "\n  ]\n}\n";
  return text;
}

std::string encode_balls_csv(const std::vector<Ball>& balls, FieldKind kind) {
  std::string text = "x,y,z,a,w,radius,xx,yy,zz,xy,xz,yz\n";
  auto out = std::back_inserter(text);
  for (const Ball& b : balls)
    fmt::format_to(out, "{},{},{},{},{},{},{},{},{},{},{},{}\n", b.center.x, b.center.y, b.center.z,
                   b.a, b.w, visible_radius(b, kind), b.shape.xx, b.shape.yy, b.shape.zz,
                   b.shape.xy, b.shape.xz, b.shape.yz);
  return text;
}

Status write_mesh(const std::filesystem::path& path, const Mesh& mesh, const MeshTags& tags) {
  if (path.extension() == ".obj") return write_file(path, encode_obj(mesh, tags.parts));
  if (path.extension() == ".ply") return write_file(path, encode_ply(mesh, tags));
  return make_error(ErrorCode::kUsage, "{}: unknown mesh format \"{}\" - use .obj or .ply",
                    path.string(), path.extension().string());
}

}  // namespace polymorph
