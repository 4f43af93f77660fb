#include "model/repair/face_classes.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <optional>

#include "base/parallel.h"
#include "mesh/closest.h"
#include "model/clustered_model.h"

namespace polymorph {
namespace {

FaceClass classify_face(const Model& model, const Triangle& triangle, const InsideTest& inside,
                        float step) {
  const Vec3 a = model.points[triangle.v[0]], b = model.points[triangle.v[1]],
             c = model.points[triangle.v[2]];
  const Vec3 normal = normalized(cross(b - a, c - a));
  int boundary = 0, sheet = 0, hidden = 0;  // numbers of tested points
  // The centroid, and three points near the corners.
  constexpr std::array<Vec3, 4> kBarycentric{
      {{1.f / 3, 1.f / 3, 1.f / 3}, {.8f, .1f, .1f}, {.1f, .8f, .1f}, {.1f, .1f, .8f}}};
  std::array<Vec3, 2 * kBarycentric.size()> probes;  // in front of all points, then behind them
  for (std::size_t i = 0; i < kBarycentric.size(); ++i) {
    const Vec3 w = kBarycentric[i], p = a * w.x + b * w.y + c * w.z;
    probes[i] = p + normal * step;
    probes[kBarycentric.size() + i] = p - normal * step;
  }
  std::array<double, probes.size()> windings;
  inside.winding_numbers(probes, windings);
  for (std::size_t i = 0; i < kBarycentric.size(); ++i) {
    const double front = windings[i], back = windings[kBarycentric.size() + i];
    const double high = std::max(front, back), low = std::min(front, back);
    sheet += high < kDecidedWinding;
    boundary += high >= kDecidedWinding && low < 0.5;  // below 0.5: outside (mesh/inside.h)
    hidden += low >= kDecidedWinding;
  }
  constexpr int kTested = kBarycentric.size();
  if (boundary == kTested) return FaceClass::kBoundary;
  if (sheet == kTested) return FaceClass::kSheet;
  return hidden == kTested ? FaceClass::kHidden : FaceClass::kMixed;
}

std::vector<FaceClass> classify_each(const Model& model, const InsideTest& inside, float step) {
  std::vector<FaceClass> classes(model.triangles.size(), FaceClass::kMixed);
  parallel_for(
      static_cast<std::int64_t>(classes.size()),
      [&](std::int64_t index) {
        const auto t = static_cast<std::size_t>(index);
        classes[t] = classify_face(model, model.triangles[t], inside, step);
      },
      /*grain=*/64);
  return classes;
}

}  // namespace

std::vector<FaceClass> classify_faces(const Model& model, const InsideTest& inside, float step) {
  const std::optional<ClusteredModel> clustered = cluster_long_triangles(model);
  if (!clustered) return classify_each(model, inside, step);
  // Each evaluation of the winding number visits nearly all long triangles, so it is made only for
  // the triangles of the simpler model.
  const std::vector<FaceClass> clustered_classes = classify_each(clustered->model, inside, step);
  const ClosestPointQuery closest(clustered->model);
  std::vector<FaceClass> classes(model.triangles.size(), FaceClass::kMixed);
  parallel_for(
      static_cast<std::int64_t>(classes.size()),
      [&](std::int64_t index) {
        const auto t = static_cast<std::size_t>(index);
        const auto& v = model.triangles[t].v;
        const Vec3 middle =
            (model.points[v[0]] + model.points[v[1]] + model.points[v[2]]) * (1.0f / 3);
        const std::uint32_t nearest = closest.closest(middle).triangle;
        if (nearest != ClosestPoint::kNoTriangle) classes[t] = clustered_classes[nearest];
      },
      /*grain=*/64);
  return classes;
}

std::vector<std::uint32_t> list_outer_faces(const std::vector<FaceClass>& classes) {
  std::vector<std::uint32_t> faces;
  for (std::size_t t = 0; t < classes.size(); ++t)
    if (classes[t] != FaceClass::kHidden) faces.push_back(static_cast<std::uint32_t>(t));
  if (faces.empty()) {
    faces.resize(classes.size());
    std::iota(faces.begin(), faces.end(), 0u);
  }
  return faces;
}

}  // namespace polymorph
