#include "model/load/build_model.h"

#include <tiny_obj_loader.h>

#include <algorithm>
#include <bit>
#include <numeric>
#include <sstream>
#include <utility>

#include "base/parallel.h"
#include "base/text.h"
#include "kernels/linear.h"
#include "mesh/edges.h"
#include "mesh/normals.h"
#include "mesh/polygon.h"
#include "model/load/text_lines.h"
#include "model/load/textures.h"
#include "model/repair/orient.h"

namespace polymorph {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;

/// Everything of the OBJ as tinyobjloader gives it: face k has scan.faces[k].corners corners.
struct RawObj {
  tinyobj::attrib_t attributes;
  std::vector<tinyobj::index_t> corners;
};

RawObj parse(ObjScan& scan) {
  RawObj raw;
  std::vector<tinyobj::shape_t> shapes;
  std::string warning, error;
  std::istringstream stream(std::move(scan.text));
  // Its own triangulation is wrong for concave polygons (tinyobjloader issues 295, 319, 386); its
  // face sizes are bytes, so ours count.
  const bool good = tinyobj::LoadObj(&raw.attributes, &shapes, nullptr, &warning, &error, &stream,
                                     nullptr, false, false);
  PM_CHECK(good && shapes.size() == 1);
  raw.corners = std::move(shapes[0].mesh.indices);
  std::size_t corners = 0;
  for (const ObjFace& face : scan.faces) corners += face.corners;
  PM_CHECK(raw.corners.size() == corners &&
           raw.attributes.vertices.size() == 3 * std::size_t{scan.points});
  return raw;
}

Vec3 vertex_of(const RawObj& raw, std::uint32_t i) {
  const auto& v = raw.attributes.vertices;
  return {v[3 * std::size_t{i}], v[3 * std::size_t{i} + 1], v[3 * std::size_t{i} + 2]};
}

/// For each vertex, the first one with exactly its coordinates.
std::vector<std::uint32_t> first_equal_vertex(const RawObj& raw, std::uint32_t count) {
  const auto bits = [&](std::uint32_t i, int axis) {
    return std::bit_cast<std::uint32_t>(
        raw.attributes.vertices[3 * std::size_t{i} + static_cast<std::size_t>(axis)]);
  };
  std::vector<std::uint32_t> order(count), first(count);
  std::iota(order.begin(), order.end(), 0u);
  const auto compare = [&](std::uint32_t a, std::uint32_t b) {
    for (int axis = 0; axis < 3; ++axis)
      if (bits(a, axis) != bits(b, axis)) return bits(a, axis) < bits(b, axis) ? -1 : 1;
    return 0;
  };
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const int c = compare(a, b);
    return c != 0 ? c < 0 : a < b;
  });
  for (std::size_t i = 0; i < order.size(); ++i)
    first[order[i]] =
        i > 0 && compare(order[i - 1], order[i]) == 0 ? first[order[i - 1]] : order[i];
  return first;
}

bool has_area(std::span<const Vec3> p, const std::array<std::uint32_t, 3>& t) {
  const Vec3d a = Vec3d(p[t[1]]) - Vec3d(p[t[0]]), b = Vec3d(p[t[2]]) - Vec3d(p[t[0]]);
  const double longest2 = std::max({dot(a, a), dot(b, b), dot(b - a, b - a)});
  return length(cross(a, b)) > 1e-9 * longest2;  // far below float's own rounding
}

/// Keeps the elements of `names` that `used` refers to, in order, and renumbers `used`.
template <class T>
void keep_used(std::vector<T>& names, std::vector<std::uint32_t>& used) {
  std::vector<std::uint32_t> new_index(names.size(), kNone);
  for (const std::uint32_t i : used) new_index[i] = 0;
  std::vector<T> kept;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (new_index[i] == kNone) continue;
    new_index[i] = static_cast<std::uint32_t>(kept.size());
    kept.push_back(std::move(names[i]));
  }
  for (std::uint32_t& i : used) i = new_index[i];
  names = std::move(kept);
}

class Builder {
 public:
  Builder(ObjScan& scan, const MtlSet& mtls, const std::filesystem::path& path,
          std::vector<std::string>& warnings)
      : scan_(scan), mtls_(mtls), file_(path.string()), warnings_(warnings), raw_(parse(scan)) {
    model_.name = printable(path.stem().string());
  }

  Result<Model> run() {
    first_equal_ = first_equal_vertex(raw_, scan_.points);
    point_of_.assign(scan_.points, kNone);
    has_uvs_ = std::any_of(raw_.corners.begin(), raw_.corners.end(),
                           [](const tinyobj::index_t& c) { return c.texcoord_index >= 0; });
    map_materials();
    add_faces();
    drop_doubles();
    add_seams();
    tell(repeated_, "faces repeat a corner - the repeated corners are merged");
    tell(flat_, "faces have no area - dropped");
    tell(crossing_, "faces cross themselves or fold over - triangulated as well as possible");
    tell(bent_,
         "faces are far from planar (more than 10 % of their size) - triangulated all the same");
    if (model_.triangles.empty())
      return make_error(ErrorCode::kInput, "{}: no faces: all {} have no area", file_,
                        scan_.faces.size());
    keep_used_names();
    turn_outward();
    fill_normals();
    tell_if_far_from_origin();
    return std::move(model_);
  }

 private:
  /// The vertex that stands for all at the place of a corner's.
  std::uint32_t point_at(std::size_t corner) const {
    return first_equal_[static_cast<std::size_t>(raw_.corners[corner].vertex_index)];
  }
  void map_materials();
  /// A face without corners that repeat, and its triangles.
  struct Outline {
    std::vector<std::size_t> kept;  ///< in RawObj::corners
    std::vector<Vec3> positions;
    PolygonTriangles polygon;
  };
  Outline outline_of(const ObjFace& face, std::size_t first) const;
  void add_faces();
  void add_face(const ObjFace& face, Outline outline);
  void add_triangle(const ObjFace& face, const std::array<std::size_t, 3>& corners);
  void drop_doubles();
  void add_seams();
  void remove_from(std::size_t first, const std::vector<std::uint8_t>& drop);
  void keep_used_points();
  void keep_used_names();
  void fill_normals();
  void turn_outward();
  void tell_if_far_from_origin();
  void tell(const Occurrences& what, const char* text) {
    if (what.count > 0)
      warnings_.push_back(fmt::format("{}:{}: {} {}", file_, what.first_line, what.count, text));
  }

  ObjScan& scan_;
  const MtlSet& mtls_;
  std::string file_;
  std::vector<std::string>& warnings_;
  RawObj raw_;
  Model model_;
  std::vector<std::uint32_t> first_equal_, point_of_;
  std::vector<std::uint32_t> material_of_;  ///< usemtl name -> material, the default last
  std::vector<const MtlMaterial*> mtl_of_;
  bool has_uvs_ = false;
  /// Faces without area whose corners are all apart.
  struct FlatFace {
    const ObjFace* face;
    std::vector<std::size_t> corners;
  };
  std::vector<FlatFace> flat_faces_;
  Occurrences repeated_, flat_, crossing_, bent_;
};

void Builder::map_materials() {
  constexpr std::size_t kMaxTold = 20;
  std::size_t missing = 0;
  const MtlNames names(mtls_);
  for (const NamedLine& used : scan_.materials) {
    const MtlMaterial* mtl = names.find(used.name);
    material_of_.push_back(static_cast<std::uint32_t>(model_.materials.size()));
    mtl_of_.push_back(mtl);
    model_.materials.push_back(mtl ? mtl->material : Material{});
    model_.materials.back().name = used.name;
    if (!mtl && !mtls_.materials.empty() && ++missing <= kMaxTold)
      warnings_.push_back(
          fmt::format("{}:{}: material \"{}\" is in no MTL - a default grey is used", file_,
                      used.line, printable(used.name)));
  }
  if (missing > kMaxTold)
    warnings_.push_back(fmt::format("{}: {} more materials are in no MTL - a default grey is used",
                                    file_, missing - kMaxTold));
  material_of_.push_back(static_cast<std::uint32_t>(model_.materials.size()));
  mtl_of_.push_back(nullptr);
  model_.materials.emplace_back().name = "default";
}

Builder::Outline Builder::outline_of(const ObjFace& face, std::size_t first) const {
  // Welding and sloppy exporters (cone tips as quads) put corners on each other: merge neighbours
  // that are one point instead of dropping the face, which would tear a hole.
  Outline outline;
  std::vector<std::size_t>& kept = outline.kept;
  for (std::size_t c = first; c < first + face.corners; ++c)
    if (kept.empty() || point_at(c) != point_at(kept.back())) kept.push_back(c);
  while (kept.size() > 1 && point_at(kept.front()) == point_at(kept.back())) kept.pop_back();
  if (kept.size() < 3) return outline;
  for (const std::size_t c : kept) outline.positions.push_back(vertex_of(raw_, point_at(c)));
  outline.polygon = triangulate(outline.positions);
  return outline;
}

void Builder::add_faces() {
  constexpr std::size_t kBatch = 4096;
  std::size_t corner = 0;
  std::vector<std::size_t> firsts(kBatch);
  std::vector<Outline> outlines(kBatch);
  for (std::size_t begin = 0; begin < scan_.faces.size(); begin += kBatch) {
    const std::size_t count = std::min(kBatch, scan_.faces.size() - begin);
    for (std::size_t i = 0; i < count; ++i) {
      firsts[i] = corner;
      corner += scan_.faces[begin + i].corners;
    }
    parallel_for(
        static_cast<std::int64_t>(count),
        [&](std::int64_t index) {
          const auto i = static_cast<std::size_t>(index);
          outlines[i] = outline_of(scan_.faces[begin + i], firsts[i]);
        },
        16);
    for (std::size_t i = 0; i < count; ++i)
      add_face(scan_.faces[begin + i], std::move(outlines[i]));
  }
}

void Builder::add_face(const ObjFace& face, Outline outline) {
  const std::vector<std::size_t>& kept = outline.kept;
  if (kept.size() < 3) {
    flat_.note(face.line);
    return;
  }
  const PolygonTriangles& polygon = outline.polygon;
  if (std::none_of(polygon.triangles.begin(), polygon.triangles.end(),
                   [&](const auto& t) { return has_area(outline.positions, t); })) {
    flat_faces_.push_back({&face, std::move(outline.kept)});
    return;
  }
  if (kept.size() < face.corners) repeated_.note(face.line);
  if (!polygon.simple) crossing_.note(face.line);
  if (!polygon.planar) bent_.note(face.line);
  // Triangles without area stay when the face has some: they close T-shaped joints.
  for (const auto& t : polygon.triangles)
    if (point_at(kept[t[0]]) != point_at(kept[t[1]]) &&
        point_at(kept[t[1]]) != point_at(kept[t[2]]) &&
        point_at(kept[t[2]]) != point_at(kept[t[0]]))
      add_triangle(face, {kept[t[0]], kept[t[1]], kept[t[2]]});
}

void Builder::add_triangle(const ObjFace& face, const std::array<std::size_t, 3>& corners) {
  const std::size_t material =
      face.material < 0 ? material_of_.size() - 1 : static_cast<std::size_t>(face.material);
  Triangle triangle;
  for (std::size_t k = 0; k < 3; ++k) {
    const tinyobj::index_t& corner = raw_.corners[corners[k]];
    const std::uint32_t vertex = first_equal_[static_cast<std::size_t>(corner.vertex_index)];
    if (point_of_[vertex] == kNone) {
      point_of_[vertex] = static_cast<std::uint32_t>(model_.points.size());
      model_.points.push_back(vertex_of(raw_, vertex));
    }
    triangle.v[k] = point_of_[vertex];
    Vec3 normal;
    if (corner.normal_index >= 0) {
      const tinyobj::real_t* n =
          &raw_.attributes.normals[3 * static_cast<std::size_t>(corner.normal_index)];
      normal = to_float(normalized(Vec3d(n[0], n[1], n[2])));
    }
    model_.corner_normals.push_back(normal);
    if (!has_uvs_) continue;
    Vec2 uv;
    if (corner.texcoord_index >= 0) {
      const tinyobj::real_t* t =
          &raw_.attributes.texcoords[2 * static_cast<std::size_t>(corner.texcoord_index)];
      uv = {t[0], t[1]};
    }
    if (const MtlMaterial* mtl = mtl_of_[material])
      uv = {uv.x * mtl->uv_scale.x + mtl->uv_offset.x, uv.y * mtl->uv_scale.y + mtl->uv_offset.y};
    model_.corner_uvs.push_back(uv);
  }
  model_.triangles.push_back(triangle);
  model_.labels.push_back(face.label);
  model_.triangle_materials.push_back(material_of_[material]);
}

void Builder::remove_from(std::size_t first, const std::vector<std::uint8_t>& drop) {
  std::size_t to = first;
  for (std::size_t t = first; t < model_.triangles.size(); ++t) {
    if (drop[t - first]) continue;
    model_.triangles[to] = model_.triangles[t];
    model_.labels[to] = model_.labels[t];
    model_.triangle_materials[to] = model_.triangle_materials[t];
    for (std::size_t k = 0; k < 3; ++k) {
      model_.corner_normals[3 * to + k] = model_.corner_normals[3 * t + k];
      if (has_uvs_) model_.corner_uvs[3 * to + k] = model_.corner_uvs[3 * t + k];
    }
    ++to;
  }
  model_.triangles.resize(to);
  model_.labels.resize(to);
  model_.triangle_materials.resize(to);
  model_.corner_normals.resize(3 * to);
  if (has_uvs_) model_.corner_uvs.resize(3 * to);
}

// A triangle that is there again, turning the same way, adds nothing but edges of four faces; files
// joined from parts have them by the thousand.
void Builder::drop_doubles() {
  struct Key {
    std::array<std::uint32_t, 3> corners;
    std::uint32_t triangle;
    auto operator<=>(const Key&) const = default;
  };
  std::vector<Key> keys(model_.triangles.size());
  for (std::uint32_t t = 0; t < keys.size(); ++t) {
    const auto& v = model_.triangles[t].v;
    keys[t] = {{v[0], v[1], v[2]}, t};
    auto& c = keys[t].corners;
    std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::uint8_t> drop(keys.size(), 0);
  std::size_t doubles = 0;
  for (std::size_t i = 1; i < keys.size(); ++i)
    if (keys[i].corners == keys[i - 1].corners) drop[keys[i].triangle] = 1, ++doubles;
  if (doubles == 0) return;
  warnings_.push_back(fmt::format(
      "{}: {} triangles are there more than once - the first of each is kept", file_, doubles));
  remove_from(0, drop);
}

/// Which of the triangles from `first` on lack a partner: exactly one other triangle along each of
/// their sides, which runs the other way and is not without partners itself.
std::vector<std::uint8_t> without_partners(std::span<const Triangle> triangles, std::size_t first) {
  std::vector<std::uint8_t> alone(triangles.size() - first, 0);
  if (alone.empty()) return alone;
  constexpr std::size_t kNoPartner = static_cast<std::size_t>(-1);
  std::vector<std::size_t> partners(3 * alone.size(), kNoPartner), waiting;
  const std::vector<EdgeUse> uses = sorted_edge_uses(triangles);
  for_each_edge(uses, [&](std::size_t begin, std::size_t end) {
    const bool paired = end - begin == 2 && uses[begin].forward != uses[begin + 1].forward;
    for (std::size_t i = begin; i < end; ++i) {
      if (uses[i].corner < 3 * first) continue;
      if (!paired)
        waiting.push_back(uses[i].corner / 3 - first);
      else if (const std::uint32_t other = uses[begin + end - 1 - i].corner; other >= 3 * first)
        partners[uses[i].corner - 3 * first] = other / 3 - first;
    }
  });
  while (!waiting.empty()) {
    const std::size_t k = waiting.back();
    waiting.pop_back();
    if (std::exchange(alone[k], 1)) continue;
    for (std::size_t side = 3 * k; side < 3 * k + 3; ++side)
      if (partners[side] != kNoPartner) waiting.push_back(partners[side]);
  }
  return alone;
}

// A face without area is dropped, unless it is the seam of a T-shaped joint: with a partner along
// each of its edges it keeps the model closed.
void Builder::add_seams() {
  const std::size_t first = model_.triangles.size();
  std::vector<std::uint32_t> lines;
  for (const FlatFace& flat : flat_faces_)
    for (std::size_t k = 1; k + 1 < flat.corners.size(); ++k) {
      add_triangle(*flat.face, {flat.corners[0], flat.corners[k], flat.corners[k + 1]});
      lines.push_back(flat.face->line);
    }
  const std::vector<std::uint8_t> drop = without_partners(model_.triangles, first);
  for (std::size_t i = 0; i < drop.size(); ++i)
    if (drop[i] && (i == 0 || !drop[i - 1] || lines[i] != lines[i - 1]))
      flat_.note(lines[i]);  // once per face
  remove_from(first, drop);
  keep_used_points();
}

void Builder::keep_used_points() {
  std::vector<std::uint32_t> used;
  for (const Triangle& t : model_.triangles) used.insert(used.end(), t.v, t.v + 3);
  keep_used(model_.points, used);
  for (std::size_t i = 0; i < used.size(); ++i) model_.triangles[i / 3].v[i % 3] = used[i];
}

void Builder::keep_used_names() {
  keep_used(scan_.labels, model_.labels);
  model_.label_names = scan_.labels;
  keep_used(model_.materials, model_.triangle_materials);
}

void Builder::fill_normals() {
  const auto missing = [](Vec3 n) { return n == Vec3{}; };
  if (std::none_of(model_.corner_normals.begin(), model_.corner_normals.end(), missing)) return;
  const std::vector<Vec3> computed = creased_normals(model_);
  for (std::size_t t = 0; t < model_.triangles.size(); ++t) {
    Vec3* n = &model_.corner_normals[3 * t];
    if (missing(n[0]) || missing(n[1]) || missing(n[2])) std::copy_n(&computed[3 * t], 3, n);
  }
}

void Builder::turn_outward() {
  const Orientation faces = orient_faces(model_);
  if (faces.turned == 0) return;
  warnings_.push_back(
      faces.turned == faces.of
          ? fmt::format("{}: the model is inside out - its faces are turned around", file_)
          : fmt::format("{}: {} of {} faces look the wrong way - they are turned around", file_,
                        faces.turned, faces.of));
}

void Builder::tell_if_far_from_origin() {
  const Box box = model_.box();
  const float far = std::max(length(box.low), length(box.high));
  if (far > 1e5f * box.diagonal())
    warnings_.push_back(
        fmt::format("{}: the model lies {:.0f} times its size away from the origin, which costs "
                    "precision - move it there before exporting",
                    file_, static_cast<double>(far / box.diagonal())));
}

}  // namespace

Result<Model> build_model(ObjScan& scan, const MtlSet& mtls, const std::filesystem::path& path,
                          std::vector<std::string>& warnings) {
  return Builder(scan, mtls, path, warnings).run();
}

}  // namespace polymorph
