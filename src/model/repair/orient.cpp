#include "model/repair/orient.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "base/exact_math.h"
#include "base/parallel.h"
#include "kernels/linear.h"
#include "mesh/edges.h"
#include "mesh/inside.h"
#include "mesh/normals.h"
#include "mesh/solid_angle.h"

namespace polymorph {
namespace {

constexpr std::size_t kSamplesPerComponent = 8;  ///< faces at which winding numbers are evaluated
constexpr std::size_t kMaxCandidates = 64;  ///< components that are examined for being inside out
/// Bounds of the mean winding number at a component's own faces: a consistent component below
/// kInsideOut may be inside out, and one whose faces were just made consistent is flipped below
/// kMostlyInward. The mean is 1/2 on a closed outward surface, -1/2 on an inward one and 0 on a
/// sheet.
constexpr double kInsideOut = -0.25, kMostlyInward = -0.05;

/// Faces that are connected by edges with exactly two faces. Edges are counted from each of their
/// two faces, i.e. twice.
struct Component {
  std::size_t begin = 0, end = 0;      ///< range of Components::order
  bool closed = true;                  ///< all edges have exactly two faces
  std::size_t inconsistent_edges = 0;  ///< edges that two faces traverse in the same direction
  /// Edges that stay inconsistent whichever faces are flipped.
  std::size_t nonorientable_edges = 0;
  /// Areas of the faces marked in Components::flip, and of all faces.
  double flipped_area = 0, area = 0;
};

struct Components {
  std::vector<Component> all;
  std::vector<std::uint32_t> order;  ///< triangles, component by component
  std::vector<std::uint8_t> flip;    ///< 1 per triangle that is to be flipped
};

Vec3d corner(const Model& model, std::uint32_t triangle, int k) {
  return Vec3d(model.points[model.triangles[triangle].v[k]]);
}

Vec3d area_vector(const Model& model, std::uint32_t t) {
  const Vec3d a = corner(model, t, 0);
  return cross(corner(model, t, 1) - a, corner(model, t, 2) - a) * 0.5;
}

/// Bit of a result of find_sides_across(): the two triangles at the edge are inconsistent.
constexpr std::uint32_t kInconsistent = 0x80000000u;
/// Finds, for each side k of each triangle t (index 3 t + k), the same edge's side of the other
/// triangle; kNoIndex unless the edge has exactly two triangles.
std::vector<std::uint32_t> find_sides_across(const Model& model) {
  std::vector<std::uint32_t> across(3 * model.triangles.size(), kNoIndex);
  const std::vector<EdgeUse> uses = sorted_edge_uses(model.triangles);
  for_each_edge(uses, [&](std::size_t first, std::size_t last) {
    if (last - first != 2) return;
    const EdgeUse &a = uses[first], &b = uses[first + 1];
    const std::uint32_t inconsistent_bit = a.forward == b.forward ? kInconsistent : 0;
    across[a.corner] = b.corner | inconsistent_bit;
    across[b.corner] = a.corner | inconsistent_bit;
  });
  return across;
}

/// Finds the components, and marks the faces whose flips make each component consistent with its
/// first face. Breadth first, from the face of lowest index of each component.
Components find_components(const Model& model) {
  const std::vector<std::uint32_t> across = find_sides_across(model);
  const std::size_t n = model.triangles.size();
  Components result;
  result.flip.assign(n, 0);
  result.order.reserve(n);
  std::vector<std::uint8_t> is_visited(n, 0);
  for (std::uint32_t seed = 0; seed < n; ++seed) {
    if (is_visited[seed]) continue;
    is_visited[seed] = 1;
    Component component;
    component.begin = result.order.size();
    result.order.push_back(seed);
    for (std::size_t at = component.begin; at < result.order.size(); ++at) {
      const std::uint32_t t = result.order[at];
      const double area = length(area_vector(model, t));
      component.area += area;
      if (result.flip[t]) component.flipped_area += area;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t side = across[3 * std::size_t{t} + k];
        if (side == kNoIndex) {
          component.closed = false;
          continue;
        }
        const std::uint32_t next = (side & ~kInconsistent) / 3;
        const bool is_inconsistent = (side & kInconsistent) != 0;
        component.inconsistent_edges += is_inconsistent;
        const auto flip = static_cast<std::uint8_t>(result.flip[t] != is_inconsistent);
        if (!is_visited[next]) {
          is_visited[next] = 1;
          result.flip[next] = flip;
          result.order.push_back(next);
        } else {
          component.nonorientable_edges += result.flip[next] != flip;
        }
      }
    }
    component.end = result.order.size();
    result.all.push_back(component);
  }
  return result;
}

/// Selects up to kSamplesPerComponent triangles of a component, evenly by area.
std::vector<std::uint32_t> sample_faces(const Model& model, const Component& component,
                                        std::span<const std::uint32_t> faces) {
  std::vector<std::uint32_t> samples;
  double sum = 0;
  for (const std::uint32_t t : faces) {
    sum += length(area_vector(model, t));
    const double next_area =
        (static_cast<double>(samples.size()) + 0.5) / kSamplesPerComponent * component.area;
    if (sum >= next_area && samples.size() < kSamplesPerComponent) samples.push_back(t);
  }
  return samples;
}

/// Computes the mean winding number of the component's own faces at the centroids of some of them.
/// A face does not count at its own centroid.
double own_winding_number(const Model& model, const Components& components,
                          const Component& component) {
  const std::span faces(components.order.data() + component.begin, component.end - component.begin);
  const std::vector<std::uint32_t> samples = sample_faces(model, component, faces);
  if (samples.empty()) return 0;
  std::vector<double> sums(samples.size(), 0);
  parallel_for(
      static_cast<std::int64_t>(samples.size()),
      [&](std::int64_t index) {
        const auto i = static_cast<std::size_t>(index);
        const std::uint32_t sample = samples[i];
        const Vec3d apex =
            (corner(model, sample, 0) + corner(model, sample, 1) + corner(model, sample, 2)) *
            (1.0 / 3);
        double sum = 0;
        for (const std::uint32_t t : faces) {
          if (t == sample) continue;
          const HalfAngle angle = half_solid_angle(
              corner(model, t, 0) - apex, corner(model, t, 1) - apex, corner(model, t, 2) - apex);
          const double half_angle = exact::atan2(angle.num, angle.den);
          sum += components.flip[t] ? -half_angle : half_angle;
        }
        sums[i] = sum / (2 * std::numbers::pi);
      },
      // Some 20 000 angles per task.
      /*grain=*/1 + 20000 / static_cast<std::int64_t>(faces.size()));
  double sum = 0;
  for (const double s : sums) sum += s;
  return sum / static_cast<double>(sums.size());
}

/// Computes the signed volume of a component after the flips that are marked.
double signed_volume(const Model& model, const Components& components, const Component& component) {
  const Vec3d origin = corner(model, components.order[component.begin], 0);
  double volume = 0;
  for (std::size_t i = component.begin; i < component.end; ++i) {
    const std::uint32_t t = components.order[i];
    const double six_volumes =
        dot(corner(model, t, 0) - origin,
            cross(corner(model, t, 1) - origin, corner(model, t, 2) - origin));
    volume += components.flip[t] ? -six_volumes / 6 : six_volumes / 6;
  }
  return volume;
}

void flip_component(Components& components, const Component& component) {
  for (std::size_t i = component.begin; i < component.end; ++i)
    components.flip[components.order[i]] ^= 1;
}

/// Decides which faces of an inconsistent component are flipped.
void choose_orientation(const Model& model, Components& components, Component& component) {
  // Flips that do not reduce the number of inconsistent edges are dropped.
  if (component.nonorientable_edges >= component.inconsistent_edges) {
    for (std::size_t i = component.begin; i < component.end; ++i)
      components.flip[components.order[i]] = 0;
    return;
  }
  if (component.flipped_area > 0.5 * component.area) flip_component(components, component);
  const bool solid = component.closed && component.nonorientable_edges == 0;
  if (solid ? signed_volume(model, components, component) < 0
            : own_winding_number(model, components, component) < kMostlyInward)
    flip_component(components, component);
}

/// Flips the marked faces, and negates their corner normals if those fit the old orientation.
void flip_faces(Model& model, const Components& components) {
  const std::vector<Vec3> normals = face_normals(model);
  for (const Component& component : components.all) {
    double agreement = 0;  // sum of dot products of the corner normals with the old face normals
    bool has_flips = false;
    for (std::size_t i = component.begin; i < component.end; ++i) {
      const std::uint32_t t = components.order[i];
      if (!components.flip[t]) continue;
      has_flips = true;
      std::swap(model.triangles[t].v[1], model.triangles[t].v[2]);
      const std::size_t c = 3 * std::size_t{t};
      if (!model.corner_uvs.empty()) std::swap(model.corner_uvs[c + 1], model.corner_uvs[c + 2]);
      if (model.corner_normals.empty()) continue;
      std::swap(model.corner_normals[c + 1], model.corner_normals[c + 2]);
      for (std::size_t k = 0; k < 3; ++k)
        agreement += static_cast<double>(dot(model.corner_normals[c + k], normals[t]));
    }
    // Some exporters flip the faces but leave the normals correct; those stay.
    if (!has_flips || agreement <= 0) continue;
    for (std::size_t i = component.begin; i < component.end; ++i) {
      const std::size_t c = 3 * std::size_t{components.order[i]};
      if (!components.flip[components.order[i]]) continue;
      for (std::size_t k = 0; k < 3; ++k)
        model.corner_normals[c + k] = -model.corner_normals[c + k];
    }
  }
}

/// Computes the mean winding number of the whole model just in front of and behind some of the
/// component's faces. An inside-out component has -1/2, a cavity of another component 1/2.
double winding_around(const Model& model, const InsideTest& inside, const Component& component,
                      std::span<const std::uint32_t> faces) {
  const double step = 1e-4 * static_cast<double>(model.box().diagonal());
  const std::vector<std::uint32_t> samples = sample_faces(model, component, faces);
  double sum = 0;
  for (const std::uint32_t t : samples) {
    const Vec3d middle =
        (corner(model, t, 0) + corner(model, t, 1) + corner(model, t, 2)) * (1.0 / 3);
    const Vec3d offset = normalized(area_vector(model, t)) * step;
    sum += inside.winding_number(to_float(middle + offset)) +
           inside.winding_number(to_float(middle - offset));
  }
  return samples.empty() ? 0 : sum / (2 * static_cast<double>(samples.size()));
}

/// Marks components that are consistently oriented, face inward and are no cavities.
void mark_inside_out(const Model& model, Components& components) {
  constexpr std::size_t kMinFaces = 4;  // a closed surface has no fewer
  std::vector<const Component*> candidates;
  for (const Component& component : components.all) {
    if (component.end - component.begin < kMinFaces || candidates.size() >= kMaxCandidates)
      continue;
    const bool solid = component.closed && component.inconsistent_edges == 0;
    if (solid ? signed_volume(model, components, component) < 0
              : own_winding_number(model, components, component) < kInsideOut)
      candidates.push_back(&component);
  }
  if (candidates.empty()) return;
  const InsideTest inside(model);
  for (const Component* component : candidates) {
    const std::span faces(components.order.data() + component->begin,
                          component->end - component->begin);
    if (winding_around(model, inside, *component, faces) < kInsideOut)
      flip_component(components, *component);
  }
}

void flip_marked_faces(Model& model, const Components& components) {
  if (std::count(components.flip.begin(), components.flip.end(), 1) > 0)
    flip_faces(model, components);
}

}  // namespace

Orientation orient_faces(Model& model) {
  const std::vector<Triangle> original_triangles = model.triangles;
  Components components = find_components(model);
  bool solid = !components.all.empty();
  for (Component& component : components.all) {
    if (component.inconsistent_edges > 0) choose_orientation(model, components, component);
    solid = solid && component.closed && component.inconsistent_edges == 0;
  }
  // A closed model of negative volume is inside out as a whole: flipping all faces keeps its
  // cavities.
  if (solid && volume_of(model) < 0) std::fill(components.flip.begin(), components.flip.end(), 1);
  flip_marked_faces(model, components);
  if (!solid || components.all.size() > 1) {
    std::fill(components.flip.begin(), components.flip.end(), 0);
    // After the flips, only the nonorientable edges are still inconsistent.
    for (Component& component : components.all)
      component.inconsistent_edges = component.nonorientable_edges;
    mark_inside_out(model, components);
    flip_marked_faces(model, components);
  }
  Orientation result{0, model.triangles.size()};
  for (std::size_t t = 0; t < original_triangles.size(); ++t)
    result.flipped += original_triangles[t].v[1] != model.triangles[t].v[1];
  return result;
}

}  // namespace polymorph
