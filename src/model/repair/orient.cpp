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

constexpr std::uint32_t kNone = 0xffffffffu;
constexpr std::size_t kSamples = 8;
constexpr std::size_t kMaxExamined = 64;
/// Halves of turns at a face: 1/2 on a closed outward surface, -1/2 on an inward one, 0 on a sheet.
constexpr double kInsideOut = -0.25, kLeaning = -0.05;

struct Component {
  std::size_t begin = 0, end = 0;  ///< in Components::order
  bool closed = true;
  std::size_t flipped = 0;  ///< edges along which its faces disagree
  std::size_t twisted = 0;  ///< those that do so whichever way faces are turned
  double turned_area = 0, area = 0;
};

struct Components {
  std::vector<Component> all;
  std::vector<std::uint32_t> order;  ///< triangles, component by component
  std::vector<std::uint8_t> turn;    ///< per triangle
};

Vec3d corner(const Model& model, std::uint32_t triangle, int k) {
  return Vec3d(model.points[model.triangles[triangle].v[k]]);
}

Vec3d area_vector(const Model& model, std::uint32_t t) {
  const Vec3d a = corner(model, t, 0);
  return cross(corner(model, t, 1) - a, corner(model, t, 2) - a) * 0.5;
}

/// The side of another triangle across each side, where the edge has two; top bit: they disagree.
constexpr std::uint32_t kFlipped = 0x80000000u;
std::vector<std::uint32_t> sides_across(const Model& model) {
  std::vector<std::uint32_t> across(3 * model.triangles.size(), kNone);
  const std::vector<EdgeUse> uses = sorted_edge_uses(model.triangles);
  for_each_edge(uses, [&](std::size_t first, std::size_t last) {
    if (last - first != 2) return;
    const EdgeUse &a = uses[first], &b = uses[first + 1];
    const std::uint32_t flipped = a.forward == b.forward ? kFlipped : 0;
    across[a.corner] = b.corner | flipped;
    across[b.corner] = a.corner | flipped;
  });
  return across;
}

Components find_components(const Model& model) {
  const std::vector<std::uint32_t> across = sides_across(model);
  const std::size_t n = model.triangles.size();
  Components result;
  result.turn.assign(n, 0);
  result.order.reserve(n);
  std::vector<std::uint8_t> seen(n, 0);
  for (std::uint32_t seed = 0; seed < n; ++seed) {
    if (seen[seed]) continue;
    seen[seed] = 1;
    Component part;
    part.begin = result.order.size();
    result.order.push_back(seed);
    for (std::size_t at = part.begin; at < result.order.size(); ++at) {
      const std::uint32_t t = result.order[at];
      const double area = length(area_vector(model, t));
      part.area += area;
      if (result.turn[t]) part.turned_area += area;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t side = across[3 * std::size_t{t} + k];
        if (side == kNone) {
          part.closed = false;
          continue;
        }
        const std::uint32_t next = (side & ~kFlipped) / 3;
        const bool flipped = (side & kFlipped) != 0;
        part.flipped += flipped;
        const auto turn = static_cast<std::uint8_t>(result.turn[t] != flipped);
        if (!seen[next]) {
          seen[next] = 1;
          result.turn[next] = turn;
          result.order.push_back(next);
        } else {
          part.twisted += result.turn[next] != turn;
        }
      }
    }
    part.end = result.order.size();
    result.all.push_back(part);
  }
  return result;
}

/// Some of a component's triangles, evenly by area.
std::vector<std::uint32_t> samples_of(const Model& model, const Component& part,
                                      std::span<const std::uint32_t> faces) {
  std::vector<std::uint32_t> samples;
  double sum = 0;
  for (const std::uint32_t t : faces) {
    sum += length(area_vector(model, t));
    const double next = (static_cast<double>(samples.size()) + 0.5) / kSamples * part.area;
    if (sum >= next && samples.size() < kSamples) samples.push_back(t);
  }
  return samples;
}

/// The mean winding number of the component's own faces at some of them, each seen from itself.
double own_winding(const Model& model, const Components& components, const Component& part) {
  const std::span faces(components.order.data() + part.begin, part.end - part.begin);
  const std::vector<std::uint32_t> samples = samples_of(model, part, faces);
  if (samples.empty()) return 0;
  std::vector<double> sums(samples.size(), 0);
  parallel_for(
      static_cast<std::int64_t>(samples.size()),
      [&](std::int64_t index) {
        const auto i = static_cast<std::size_t>(index);
        const std::uint32_t at = samples[i];
        const Vec3d eye =
            (corner(model, at, 0) + corner(model, at, 1) + corner(model, at, 2)) * (1.0 / 3);
        double sum = 0;
        for (const std::uint32_t t : faces) {
          if (t == at) continue;
          const HalfAngle angle = half_solid_angle(
              corner(model, t, 0) - eye, corner(model, t, 1) - eye, corner(model, t, 2) - eye);
          const double half = exact::atan2(angle.num, angle.den);
          sum += components.turn[t] ? -half : half;
        }
        sums[i] = sum / (2 * std::numbers::pi);
      },
      1 + 20000 / static_cast<std::int64_t>(faces.size()));
  double sum = 0;
  for (const double s : sums) sum += s;
  return sum / static_cast<double>(sums.size());
}

double volume_of(const Model& model, const Components& components, const Component& part) {
  const Vec3d origin = corner(model, components.order[part.begin], 0);
  double volume = 0;
  for (std::size_t i = part.begin; i < part.end; ++i) {
    const std::uint32_t t = components.order[i];
    const double six = dot(corner(model, t, 0) - origin,
                           cross(corner(model, t, 1) - origin, corner(model, t, 2) - origin));
    volume += components.turn[t] ? -six / 6 : six / 6;
  }
  return volume;
}

void turn_component(Components& components, const Component& part) {
  for (std::size_t i = part.begin; i < part.end; ++i) components.turn[components.order[i]] ^= 1;
}

/// Which of the faces that disagree are turned.
void settle(const Model& model, Components& components, Component& part) {
  if (part.twisted >= part.flipped) {
    for (std::size_t i = part.begin; i < part.end; ++i) components.turn[components.order[i]] = 0;
    return;
  }
  if (part.turned_area > 0.5 * part.area) turn_component(components, part);
  const bool solid = part.closed && part.twisted == 0;
  if (solid ? volume_of(model, components, part) < 0
            : own_winding(model, components, part) < kLeaning)
    turn_component(components, part);
}

void turn_faces(Model& model, const Components& components) {
  const std::vector<Vec3> normals = face_normals(model);
  for (const Component& part : components.all) {
    double agreement = 0;
    bool any = false;
    for (std::size_t i = part.begin; i < part.end; ++i) {
      const std::uint32_t t = components.order[i];
      if (!components.turn[t]) continue;
      any = true;
      std::swap(model.triangles[t].v[1], model.triangles[t].v[2]);
      const std::size_t c = 3 * std::size_t{t};
      if (!model.corner_uvs.empty()) std::swap(model.corner_uvs[c + 1], model.corner_uvs[c + 2]);
      if (model.corner_normals.empty()) continue;
      std::swap(model.corner_normals[c + 1], model.corner_normals[c + 2]);
      for (std::size_t k = 0; k < 3; ++k)
        agreement += static_cast<double>(dot(model.corner_normals[c + k], normals[t]));
    }
    // Some exporters turn the faces but leave the normals right.
    if (!any || agreement <= 0) continue;
    for (std::size_t i = part.begin; i < part.end; ++i) {
      const std::size_t c = 3 * std::size_t{components.order[i]};
      if (!components.turn[components.order[i]]) continue;
      for (std::size_t k = 0; k < 3; ++k)
        model.corner_normals[c + k] = -model.corner_normals[c + k];
    }
  }
}

/// The mean winding number of the whole model just in front of and behind some of the faces.
double winding_around(const Model& model, const InsideTest& inside, const Component& part,
                      std::span<const std::uint32_t> faces) {
  const double step = 1e-4 * static_cast<double>(model.box().diagonal());
  const std::vector<std::uint32_t> samples = samples_of(model, part, faces);
  double sum = 0;
  for (const std::uint32_t t : samples) {
    const Vec3d middle =
        (corner(model, t, 0) + corner(model, t, 1) + corner(model, t, 2)) * (1.0 / 3);
    const Vec3d off = normalized(area_vector(model, t)) * step;
    sum += inside.winding_number(to_float(middle + off)) +
           inside.winding_number(to_float(middle - off));
  }
  return samples.empty() ? 0 : sum / (2 * static_cast<double>(samples.size()));
}

/// Marks components that agree with themselves but look inward, other than cavities.
void find_inside_out(const Model& model, Components& components) {
  constexpr std::size_t kFewestFaces = 4;
  std::vector<const Component*> doubtful;
  for (const Component& part : components.all) {
    if (part.end - part.begin < kFewestFaces || doubtful.size() >= kMaxExamined) continue;
    const bool solid = part.closed && part.flipped == 0;
    if (solid ? volume_of(model, components, part) < 0
              : own_winding(model, components, part) < kInsideOut)
      doubtful.push_back(&part);
  }
  if (doubtful.empty()) return;
  const InsideTest inside(model);
  for (const Component* part : doubtful) {
    const std::span faces(components.order.data() + part->begin, part->end - part->begin);
    if (winding_around(model, inside, *part, faces) < kInsideOut) turn_component(components, *part);
  }
}

void turn_marked(Model& model, const Components& components) {
  if (std::count(components.turn.begin(), components.turn.end(), 1) > 0)
    turn_faces(model, components);
}

}  // namespace

Orientation orient_faces(Model& model) {
  const std::vector<Triangle> before = model.triangles;
  Components components = find_components(model);
  bool solid = !components.all.empty();
  for (Component& part : components.all) {
    if (part.flipped > 0) settle(model, components, part);
    solid = solid && part.closed && part.flipped == 0;
  }
  // A closed model that is inside out as a whole keeps its cavities.
  if (solid && volume_of(model) < 0) std::fill(components.turn.begin(), components.turn.end(), 1);
  turn_marked(model, components);
  if (!solid || components.all.size() > 1) {
    std::fill(components.turn.begin(), components.turn.end(), 0);
    for (Component& part : components.all) part.flipped = part.twisted;
    find_inside_out(model, components);
    turn_marked(model, components);
  }
  Orientation result{0, model.triangles.size()};
  for (std::size_t t = 0; t < before.size(); ++t)
    result.turned += before[t].v[1] != model.triangles[t].v[1];
  return result;
}

}  // namespace polymorph
