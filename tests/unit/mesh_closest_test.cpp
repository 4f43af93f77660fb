#include "mesh/closest.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "base/parallel.h"
#include "kernels/linear.h"
#include "model/shapes.h"
#include "testing/model.h"

namespace polymorph {
namespace {

double distance_to_segment(Vec3d p, Vec3d a, Vec3d b) {
  const Vec3d ab = b - a;
  const double t = dot(ab, ab) > 0 ? std::clamp(dot(ab, p - a) / dot(ab, ab), 0.0, 1.0) : 0;
  return length(p - (a + ab * t));
}

/// Another way than the code's: the plane where the foot falls into the triangle, else the edges.
double distance_to_triangle(Vec3d p, Vec3d a, Vec3d b, Vec3d c) {
  double best = std::min(
      {distance_to_segment(p, a, b), distance_to_segment(p, b, c), distance_to_segment(p, c, a)});
  const Vec3d n = normalized(cross(b - a, c - a));
  if (dot(n, n) == 0) return best;
  const double height = dot(p - a, n);
  const Vec3d foot = p - n * height;
  if (dot(cross(b - a, foot - a), n) >= 0 && dot(cross(c - b, foot - b), n) >= 0 &&
      dot(cross(a - c, foot - c), n) >= 0)
    best = std::min(best, std::abs(height));
  return best;
}

double distance_to_model(Vec3 p, const Model& model) {
  double best = INFINITY;
  for (const Triangle& t : model.triangles)
    best = std::min(best,
                    distance_to_triangle(Vec3d(p), Vec3d(model.points[t.v[0]]),
                                         Vec3d(model.points[t.v[1]]), Vec3d(model.points[t.v[2]])));
  return best;
}

class Random {
 public:
  float operator()(float low, float high) {
    return low + (high - low) * static_cast<float>(engine_() >> 8) * 0x1p-24f;
  }
  Vec3 point(float low, float high) {
    const float x = (*this)(low, high), y = (*this)(low, high);
    return {x, y, (*this)(low, high)};
  }

 private:
  std::mt19937 engine_{11};
};

void expect_closest(const Model& model, Vec3 p, const ClosestPoint& found) {
  ASSERT_LT(found.triangle, model.triangles.size());
  // What rounding leaves of the coordinates.
  const double size = static_cast<double>(model.box().diagonal() + length(model.box().center()) +
                                          length(p - model.box().center()));
  EXPECT_NEAR(static_cast<double>(found.distance), distance_to_model(p, model), 3e-7 * size);
  EXPECT_NEAR(length(found.point - p), found.distance, 3e-7 * size);
  const auto& v = model.triangles[found.triangle].v;
  EXPECT_LT(distance_to_triangle(Vec3d(found.point), Vec3d(model.points[v[0]]),
                                 Vec3d(model.points[v[1]]), Vec3d(model.points[v[2]])),
            3e-7 * size)
      << "the point lies on the triangle that is named";
}

TEST(ClosestPoint, AgreesWithBruteForceNearAndFar) {
  Random random;
  for (const char* name : {"torus", "cube", "puddle"}) {
    const Model model = make_shape(name).value();
    const ClosestPointQuery query(model);
    for (int i = 0; i < 150; ++i) {
      const float reach = i % 3 == 0 ? 50.0f : 2.0f;
      const Vec3 p = random.point(-reach, reach);
      expect_closest(model, p, query.closest(p));
    }
  }
}

TEST(ClosestPoint, TrianglesWithoutAreaStandForTheirSegmentOrPoint) {
  Random random;
  Model model;
  const auto add = [&](Vec3 a, Vec3 b, Vec3 c) {
    const auto base = static_cast<std::uint32_t>(model.points.size());
    model.points.insert(model.points.end(), {a, b, c});
    model.triangles.push_back({{base, base + 1, base + 2}});
  };
  for (int i = 0; i < 60; ++i) {
    const Vec3 a = random.point(-1, 1), b = random.point(-1, 1);
    add(a, a, a);
    add(a, b, a);
    add(a, a, b);
    add(b, a, a);
    add(a, b, a + (b - a) * random(-2, 2));
    add(a, b, a + (b - a) * 0.5f + random.point(-1e-6f, 1e-6f));
  }
  for (std::uint32_t t = 0; t < model.triangles.size(); ++t) {
    Model one = model;
    one.triangles = {model.triangles[t]};
    const ClosestPointQuery query(one);
    for (int i = 0; i < 5; ++i) {
      const Vec3 p = random.point(-2, 2);
      expect_closest(one, p, query.closest(p));
    }
  }
  const ClosestPointQuery query(model);
  for (int i = 0; i < 300; ++i) {
    const Vec3 p = random.point(-2, 2);
    expect_closest(model, p, query.closest(p));
  }
}

TEST(ClosestPoint, OfEquallyCloseTrianglesTheFirstIsTaken) {
  Model box = box_model({-1, -1, -1}, {1, 1, 1});
  const ClosestPoint corner = ClosestPointQuery(box).closest({2, 2, 2});
  EXPECT_EQ(corner.point, (Vec3{1, 1, 1}));
  EXPECT_FLOAT_EQ(corner.distance, std::sqrt(3.0f));
  std::uint32_t first = 0;  // the first with point 7, which is that corner
  const auto has_corner = [](const Triangle& t) {
    return t.v[0] == 7 || t.v[1] == 7 || t.v[2] == 7;
  };
  while (!has_corner(box.triangles[first])) ++first;
  EXPECT_EQ(corner.triangle, first);
  // Twenty copies of everything: still the first copy, although most leaves hold later ones.
  const std::vector<Triangle> once = box.triangles;
  for (int copy = 0; copy < 20; ++copy)
    box.triangles.insert(box.triangles.end(), once.begin(), once.end());
  const ClosestPointQuery query(box);
  Random random;
  for (int i = 0; i < 200; ++i) EXPECT_LT(query.closest(random.point(-3, 3)).triangle, once.size());
}

TEST(ClosestPoint, GivesUpBeyondTheDistanceAskedFor) {
  const Model box = box_model({-1, -1, -1}, {1, 1, 1});
  const ClosestPointQuery query(box);
  const ClosestPoint none = query.closest({3, 0, 0}, 1.5f);
  EXPECT_EQ(none.triangle, ClosestPoint::kNoTriangle);
  EXPECT_EQ(none.distance, 1.5f);
  EXPECT_EQ(none.point, (Vec3{3, 0, 0}));
  const ClosestPoint exactly = query.closest({3, 0.25f, 0}, 2.0f);
  EXPECT_EQ(exactly.distance, 2.0f) << "no further than";
  EXPECT_EQ(exactly.point, (Vec3{1, 0.25f, 0}));
  EXPECT_EQ(query.closest({std::nanf(""), 0, 0}).triangle, ClosestPoint::kNoTriangle);
  const ClosestPoint nothing = ClosestPointQuery(Model{}).closest({1, 2, 3});
  EXPECT_EQ(nothing.triangle, ClosestPoint::kNoTriangle);
  EXPECT_EQ(nothing.distance, std::numeric_limits<float>::infinity());
}

TEST(ClosestPoint, OfManyPointsIsThatOfEachAlone) {
  const Model torus = *make_shape("torus");
  const ClosestPointQuery query(torus);
  const Box box = torus.box();
  Random random;
  std::vector<Vec3> points;  // along a path with jumps, on the surface and off it, some twice
  for (int i = 0; i < 4000; ++i) {
    const Vec3 step = random.point(-0.02f, 0.02f);
    const bool jumps = i % 97 == 0;
    points.push_back(jumps        ? box.center() + random.point(-3, 3)
                     : i % 5 == 0 ? points.back()
                                  : points.back() + step);
    if (i % 11 == 0)
      points.push_back(torus.points[static_cast<std::size_t>(i) % torus.points.size()]);
    if (i % 13 == 0) {  // as close to a face as rounding lets it, twice
      const Triangle& t = torus.triangles[static_cast<std::size_t>(i) % torus.triangles.size()];
      const Vec3 middle =
          (torus.points[t.v[0]] + torus.points[t.v[1]] + torus.points[t.v[2]]) / 3.0f;
      points.insert(points.end(), 2, middle);
    }
  }
  for (const float beyond : {0.1f, 1.0f, INFINITY}) {
    const std::vector<ClosestPoint> together = query.closest(points, beyond);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const ClosestPoint alone = query.closest(points[i], beyond);
      ASSERT_EQ(together[i].triangle, alone.triangle) << i;
      ASSERT_EQ(together[i].distance, alone.distance) << i;
      ASSERT_EQ(together[i].point, alone.point) << i;
    }
  }
}

TEST(ClosestPoint, DoesNotDependOnThreadsAndWorksFarFromTheOrigin) {
  Random random;
  Model torus = make_shape("torus").value();
  for (Vec3& p : torus.points) p = p * 256 + Vec3{8192, -4096, 16384};
  std::vector<Vec3> from;
  for (int i = 0; i < 2000; ++i) from.push_back(random.point(-400, 400) + Vec3{8192, -4096, 16384});
  const ClosestPointQuery query(torus);
  set_thread_count(1);
  const std::vector<ClosestPoint> one = query.closest(from);
  set_thread_count(2);
  const std::vector<ClosestPoint> two = query.closest(from);
  set_thread_count(0);
  for (std::size_t i = 0; i < from.size(); ++i) {
    EXPECT_EQ(one[i].point, two[i].point);
    EXPECT_EQ(one[i].triangle, two[i].triangle);
    if (i % 50 == 0) expect_closest(torus, from[i], one[i]);
  }
}

}  // namespace
}  // namespace polymorph
