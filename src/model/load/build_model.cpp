#include "model/load/build_model.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "base/box.h"
#include "base/parallel.h"
#include "base/text.h"
#include "image/srgb.h"
#include "kernels/linear.h"
#include "mesh/edges.h"
#include "mesh/normals.h"
#include "mesh/polygon.h"
#include "model/load/text_lines.h"
#include "model/load/textures.h"
#include "model/repair/orient.h"

namespace polymorph {
namespace {

Vec3 vertex_position(const ObjScan& scan, std::uint32_t i) {
  const float* v = &scan.positions[3 * std::size_t{i}];
  return {v[0], v[1], v[2]};
}

/// Finds, for each vertex, the first one with exactly the same coordinates.
std::vector<std::uint32_t> find_first_equal(const ObjScan& scan) {
  const auto bits = [&](std::uint32_t i, int axis) {
    return std::bit_cast<std::uint32_t>(
        scan.positions[3 * std::size_t{i} + static_cast<std::size_t>(axis)]);
  };
  std::vector<std::uint32_t> order(scan.point_count()), first(scan.point_count());
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
  return length(cross(a, b)) > 1e-9 * longest2;  // far below the rounding of floats
}

/// Removes the elements of `names` that no index in `used` refers to, keeps the order, and
/// renumbers `used`.
template <class T>
void remove_unused(std::vector<T>& names, std::vector<std::uint32_t>& used) {
  std::vector<std::uint32_t> new_index(names.size(), kNoIndex);
  for (const std::uint32_t i : used) new_index[i] = 0;
  std::vector<T> used_names;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (new_index[i] == kNoIndex) continue;
    new_index[i] = static_cast<std::uint32_t>(used_names.size());
    used_names.push_back(std::move(names[i]));
  }
  for (std::uint32_t& i : used) i = new_index[i];
  names = std::move(used_names);
}

class Builder {
 public:
  Builder(ObjScan& scan, const MtlSet& mtls, const std::filesystem::path& path,
          std::vector<std::string>& warnings)
      : scan_(scan), mtls_(mtls), file_(path.string()), warnings_(warnings) {
    model_.name = printable(path.stem().string());
  }

  std::vector<Vec3> vertices() const {
    std::vector<Vec3> positions;
    for (std::uint32_t i = 0; i < scan_.point_count(); ++i)
      positions.push_back(vertex_position(scan_, i));
    return positions;
  }

  Result<Model> build() {
    representative_ = find_first_equal(scan_);
    point_index_.assign(scan_.point_count(), kNoIndex);
    has_uvs_ = std::any_of(scan_.corners.begin(), scan_.corners.end(),
                           [](const ObjCorner& c) { return c.vt >= 0; });
    map_materials();
    add_faces();
    drop_duplicates();
    add_flat_faces();
    report(repeated_, "face repeats a corner - the repeated corners are merged",
           "faces repeat a corner - the repeated corners are merged");
    report(flat_count_, "face has no area - dropped", "faces have no area - dropped");
    report(crossing_, "face crosses itself or folds over - triangulated as well as possible",
           "faces cross themselves or fold over - triangulated as well as possible");
    report(nonplanar_,
           "face is far from planar (more than 10 % of its size) - triangulated all the same",
           "faces are far from planar (more than 10 % of their size) - triangulated all the same");
    if (model_.triangles.empty())
      return make_error(ErrorCode::kInput, "{}: no faces: {} no area{}", file_,
                        scan_.faces.size() == 1 ? "the only one has"
                                                : fmt::format("all {} have", scan_.faces.size()),
                        describe_distance_problem());
    remove_unused_names();
    orient_outward();
    fill_normals();
    check_distance_from_origin();
    return std::move(model_);
  }

 private:
  /// Returns advice if the points lie so far from the origin that they coincide in single
  /// precision; else an empty string.
  std::string describe_distance_problem() const {
    constexpr float kMinDistance = 1e4f, kMinRatio = 1e6f;  // coordinate, and coordinate / size
    float max_coordinate = 0;
    Box box;
    for (std::uint32_t i = 0; i < scan_.point_count(); ++i) {
      const Vec3 p = vertex_position(scan_, i);
      max_coordinate = std::max({max_coordinate, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
      box = extend(box, p);
    }
    const Vec3 size = box.size();
    if (max_coordinate < kMinDistance ||
        std::max({size.x, size.y, size.z}) * kMinRatio > max_coordinate)
      return "";
    return fmt::format(
        "; the points lie {:.0g} from the origin, too far for the seven digits of a coordinate - "
        "move the model to the origin",
        max_coordinate);
  }

  /// Returns the representative of a corner's vertex: the first vertex at the same position.
  std::uint32_t point_at(std::size_t corner) const {
    return representative_[static_cast<std::size_t>(scan_.corners[corner].v)];
  }
  void map_materials();
  std::uint32_t find_color_material(const ObjFace& face, std::size_t material);
  /// A face without repeated corners, and its triangles.
  struct Outline {
    std::vector<std::size_t> corners;  ///< indices in ObjScan::corners
    std::vector<Vec3> positions;
    PolygonTriangles polygon;
  };
  Outline make_outline(const ObjFace& face, std::size_t first) const;
  void add_faces();
  void add_face(const ObjFace& face, Outline outline);
  void add_triangle(const ObjFace& face, const std::array<std::size_t, 3>& corners);
  void drop_duplicates();
  void add_flat_faces();
  void remove_triangles(std::size_t first, const std::vector<std::uint8_t>& is_dropped);
  void remove_unused_points();
  void remove_unused_names();
  void fill_normals();
  void orient_outward();
  void check_distance_from_origin();
  void report(const Occurrences& events, const char* singular, const char* plural) {
    if (events.count > 0)
      warnings_.push_back(fmt::format("{}:{}: {} {}", file_, events.first_line, events.count,
                                      events.count == 1 ? singular : plural));
  }

  ObjScan& scan_;
  const MtlSet& mtls_;
  std::string file_;
  std::vector<std::string>& warnings_;
  Model model_;
  /// Per vertex: its representative, and (for representatives) its index in model_.points.
  std::vector<std::uint32_t> representative_, point_index_;
  /// Index in model_.materials per usemtl name; the last one is the default material.
  std::vector<std::uint32_t> material_index_;
  std::vector<const MtlMaterial*> mtls_by_material_;  ///< per usemtl name; null if in no MTL
  /// Materials made of point colours, by usemtl name's index and colour (ObjFace::color).
  std::map<std::pair<std::size_t, std::int32_t>, std::uint32_t> color_materials_;
  bool has_uvs_ = false;
  /// A face without area whose corners are distinct.
  struct FlatFace {
    const ObjFace* face;
    std::vector<std::size_t> corners;
  };
  std::vector<FlatFace> flat_faces_;
  Occurrences repeated_, flat_count_, crossing_, nonplanar_;  ///< faces; build() names the problems
};

void Builder::map_materials() {
  constexpr std::size_t kMaxReported = 20;
  std::size_t missing = 0;
  const MtlNames names(mtls_);
  for (const NamedLine& used : scan_.materials) {
    const MtlMaterial* mtl = names.find(used.name);
    material_index_.push_back(static_cast<std::uint32_t>(model_.materials.size()));
    mtls_by_material_.push_back(mtl);
    model_.materials.push_back(mtl ? mtl->material : Material{});
    model_.materials.back().name = used.name;
    if (!mtl && !mtls_.materials.empty() && ++missing <= kMaxReported)
      warnings_.push_back(
          fmt::format("{}:{}: material \"{}\" is in no MTL - a default grey is used", file_,
                      used.line, printable(used.name)));
  }
  if (missing > kMaxReported)
    warnings_.push_back(fmt::format("{}: {} more materials are in no MTL - a default grey is used",
                                    file_, missing - kMaxReported));
  material_index_.push_back(static_cast<std::uint32_t>(model_.materials.size()));
  mtls_by_material_.push_back(nullptr);
  model_.materials.emplace_back().name = "default";
}

/// Returns the index of the face's material, with the colour of its points unless a texture gives
/// the colour. `material`: index of its usemtl name.
std::uint32_t Builder::find_color_material(const ObjFace& face, std::size_t material) {
  const MtlMaterial* mtl = mtls_by_material_[material];
  if (face.color == ObjFace::kNoColor || (mtl && !mtl->texture.empty()))
    return material_index_[material];
  const auto [entry, is_new] =
      color_materials_.try_emplace({material, face.color}, model_.materials.size());
  if (is_new) {
    Material colored = mtl ? mtl->material : Material{};
    const auto component = [&](int shift) {
      return srgb_to_linear(static_cast<float>(face.color >> shift & 255) / 255);
    };
    colored.color = {component(16), component(8), component(0)};
    colored.name = fmt::format("color_{:06x}", face.color);
    model_.materials.push_back(std::move(colored));
  }
  return entry->second;
}

Builder::Outline Builder::make_outline(const ObjFace& face, std::size_t first) const {
  // Welding and some exporters (cone tips as quads) make corners coincide: merge adjacent corners
  // at one point instead of dropping the face, which would leave a hole.
  Outline outline;
  std::vector<std::size_t>& corners = outline.corners;
  for (std::size_t c = first; c < first + face.corners; ++c)
    if (corners.empty() || point_at(c) != point_at(corners.back())) corners.push_back(c);
  while (corners.size() > 1 && point_at(corners.front()) == point_at(corners.back()))
    corners.pop_back();
  if (corners.size() < 3) return outline;
  for (const std::size_t c : corners)
    outline.positions.push_back(vertex_position(scan_, point_at(c)));
  outline.polygon = triangulate(outline.positions);
  return outline;
}

// Outlines are made in parallel, and their triangles are added in order.
void Builder::add_faces() {
  constexpr std::size_t kBatch = 4096;
  std::size_t corner = 0;
  std::vector<std::size_t> first_corners(kBatch);
  std::vector<Outline> outlines(kBatch);
  for (std::size_t begin = 0; begin < scan_.faces.size(); begin += kBatch) {
    const std::size_t count = std::min(kBatch, scan_.faces.size() - begin);
    for (std::size_t i = 0; i < count; ++i) {
      first_corners[i] = corner;
      corner += scan_.faces[begin + i].corners;
    }
    parallel_for(
        static_cast<std::int64_t>(count),
        [&](std::int64_t index) {
          const auto i = static_cast<std::size_t>(index);
          outlines[i] = make_outline(scan_.faces[begin + i], first_corners[i]);
        },
        /*grain=*/16);
    for (std::size_t i = 0; i < count; ++i)
      add_face(scan_.faces[begin + i], std::move(outlines[i]));
  }
}

void Builder::add_face(const ObjFace& face, Outline outline) {
  const std::vector<std::size_t>& corners = outline.corners;
  if (corners.size() < 3) {
    flat_count_.note(face.line);
    return;
  }
  const PolygonTriangles& polygon = outline.polygon;
  if (std::none_of(polygon.triangles.begin(), polygon.triangles.end(),
                   [&](const auto& t) { return has_area(outline.positions, t); })) {
    flat_faces_.push_back({&face, std::move(outline.corners)});
    return;
  }
  if (corners.size() < face.corners) repeated_.note(face.line);
  if (!polygon.simple) crossing_.note(face.line);
  if (!polygon.planar) nonplanar_.note(face.line);
  // Triangles without area stay if their face has an area: they close T-junctions.
  for (const auto& t : polygon.triangles)
    if (point_at(corners[t[0]]) != point_at(corners[t[1]]) &&
        point_at(corners[t[1]]) != point_at(corners[t[2]]) &&
        point_at(corners[t[2]]) != point_at(corners[t[0]]))
      add_triangle(face, {corners[t[0]], corners[t[1]], corners[t[2]]});
}

void Builder::add_triangle(const ObjFace& face, const std::array<std::size_t, 3>& corners) {
  const std::size_t material =
      face.material < 0 ? material_index_.size() - 1 : static_cast<std::size_t>(face.material);
  Triangle triangle;
  for (std::size_t k = 0; k < 3; ++k) {
    const ObjCorner& corner = scan_.corners[corners[k]];
    const std::uint32_t vertex = point_at(corners[k]);
    if (point_index_[vertex] == kNoIndex) {
      point_index_[vertex] = static_cast<std::uint32_t>(model_.points.size());
      model_.points.push_back(vertex_position(scan_, vertex));
    }
    triangle.v[k] = point_index_[vertex];
    Vec3 normal;
    if (corner.vn >= 0) {
      const float* n = &scan_.normals[3 * static_cast<std::size_t>(corner.vn)];
      normal = to_float(normalized(Vec3d(n[0], n[1], n[2])));
    }
    model_.corner_normals.push_back(normal);
    if (!has_uvs_) continue;
    Vec2 uv;
    if (corner.vt >= 0) {
      const float* t = &scan_.uvs[2 * static_cast<std::size_t>(corner.vt)];
      uv = {t[0], t[1]};
    }
    if (const MtlMaterial* mtl = mtls_by_material_[material])
      uv = {uv.x * mtl->uv_scale.x + mtl->uv_offset.x, uv.y * mtl->uv_scale.y + mtl->uv_offset.y};
    model_.corner_uvs.push_back(uv);
  }
  model_.triangles.push_back(triangle);
  model_.labels.push_back(face.label);
  model_.triangle_materials.push_back(find_color_material(face, material));
}

/// Removes each triangle t >= `first` for which is_dropped[t - first] is set.
void Builder::remove_triangles(std::size_t first, const std::vector<std::uint8_t>& is_dropped) {
  std::size_t to = first;
  for (std::size_t t = first; t < model_.triangles.size(); ++t) {
    if (is_dropped[t - first]) continue;
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

// Duplicates of a triangle with the same orientation only make edges non-manifold; files that were
// merged from several have thousands of them.
void Builder::drop_duplicates() {
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
    // The rotation to the lowest corner keeps the orientation.
    std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::uint8_t> is_dropped(keys.size(), 0);
  std::size_t duplicates = 0;
  for (std::size_t i = 1; i < keys.size(); ++i)
    if (keys[i].corners == keys[i - 1].corners) is_dropped[keys[i].triangle] = 1, ++duplicates;
  if (duplicates == 0) return;
  warnings_.push_back(fmt::format(
      "{}: {} triangles are there more than once - the first of each is kept", file_, duplicates));
  remove_triangles(0, is_dropped);
}

/// Tests for each triangle from `first` on whether it is unpaired. A triangle is paired if along
/// each of its sides there is exactly one other triangle, which runs in the opposite direction and,
/// if it is one of those from `first` on, is paired itself.
std::vector<std::uint8_t> find_unpaired(std::span<const Triangle> triangles, std::size_t first) {
  std::vector<std::uint8_t> is_unpaired(triangles.size() - first, 0);
  if (is_unpaired.empty()) return is_unpaired;
  // Of each side of the triangles from `first` on: the paired triangle's index, minus `first`.
  constexpr std::size_t kNoPartner = static_cast<std::size_t>(-1);
  std::vector<std::size_t> partners(3 * is_unpaired.size(), kNoPartner), stack;
  const std::vector<EdgeUse> uses = sorted_edge_uses(triangles);
  for_each_edge(uses, [&](std::size_t begin, std::size_t end) {
    const bool is_paired = end - begin == 2 && uses[begin].forward != uses[begin + 1].forward;
    for (std::size_t i = begin; i < end; ++i) {
      if (uses[i].corner < 3 * first) continue;
      if (!is_paired) stack.push_back(uses[i].corner / 3 - first);
      // Of the two uses, begin + end - 1 - i is the other one.
      else if (const std::uint32_t other = uses[begin + end - 1 - i].corner; other >= 3 * first)
        partners[uses[i].corner - 3 * first] = other / 3 - first;
    }
  });
  // Partners of an unpaired triangle are unpaired, too.
  while (!stack.empty()) {
    const std::size_t k = stack.back();
    stack.pop_back();
    if (std::exchange(is_unpaired[k], 1)) continue;
    for (std::size_t side = 3 * k; side < 3 * k + 3; ++side)
      if (partners[side] != kNoPartner) stack.push_back(partners[side]);
  }
  return is_unpaired;
}

// Adds the faces without area that close a T-junction, and drops the others. A face that closes a
// T-junction has a partner along each of its edges; without it, the model would be open.
void Builder::add_flat_faces() {
  const std::size_t first = model_.triangles.size();
  std::vector<std::uint32_t> face_lines;
  for (const FlatFace& flat : flat_faces_)
    for (std::size_t k = 1; k + 1 < flat.corners.size(); ++k) {
      add_triangle(*flat.face, {flat.corners[0], flat.corners[k], flat.corners[k + 1]});
      face_lines.push_back(flat.face->line);
    }
  const std::vector<std::uint8_t> is_dropped = find_unpaired(model_.triangles, first);
  for (std::size_t i = 0; i < is_dropped.size(); ++i)
    if (is_dropped[i] && (i == 0 || !is_dropped[i - 1] || face_lines[i] != face_lines[i - 1]))
      flat_count_.note(face_lines[i]);  // count a face once, not each of its triangles
  remove_triangles(first, is_dropped);
  remove_unused_points();
}

void Builder::remove_unused_points() {
  std::vector<std::uint32_t> used;
  for (const Triangle& t : model_.triangles) used.insert(used.end(), t.v, t.v + 3);
  remove_unused(model_.points, used);
  for (std::size_t i = 0; i < used.size(); ++i) model_.triangles[i / 3].v[i % 3] = used[i];
}

void Builder::remove_unused_names() {
  remove_unused(scan_.labels, model_.labels);
  model_.label_names = scan_.labels;
  remove_unused(model_.materials, model_.triangle_materials);
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

void Builder::orient_outward() {
  const Orientation faces = orient_faces(model_);
  if (faces.flipped == 0) return;
  warnings_.push_back(
      faces.flipped == faces.faces
          ? fmt::format("{}: the model is inside out - its faces are flipped", file_)
          : fmt::format("{}: {} of {} faces point inwards - flipped", file_, faces.flipped,
                        faces.faces));
}

void Builder::check_distance_from_origin() {
  const Box box = model_.box();
  const float max_distance = std::max(length(box.low), length(box.high));
  if (max_distance > 1e5f * box.diagonal())
    warnings_.push_back(
        fmt::format("{}: the model lies {:.0f} times its size away from the origin, which costs "
                    "precision - move it there before exporting",
                    file_, static_cast<double>(max_distance / box.diagonal())));
}

}  // namespace

Result<Model> build_model(ObjScan& scan, const MtlSet& mtls, const std::filesystem::path& path,
                          std::vector<std::string>& warnings, std::vector<Vec3>* vertices) {
  Builder builder(scan, mtls, path, warnings);
  if (vertices) *vertices = builder.vertices();
  return builder.build();
}

}  // namespace polymorph
