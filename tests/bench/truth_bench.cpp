// How near a plan and its map bring known points to where they belong: truth_bench TRUTH.json
// [PAIR...]. The file has "models" ({"NAME": {"model": PATH, "up": "y", "points": {"nose": [x, y,
// z],
// ...}}}, points in the model's own coordinates) and "pairs" ([["FROM", "TO"], ...]); points of the
// same name belong together. Each pair gets a line for the plan without limbs and one with: the
// share of points within 5 and 10 % of the target's diagonal and the mean error, both ways, by the
// nearest balls' own targets and by the map at the motion's ends.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "kernels/field_kinds.h"
#include "mesh/closest.h"
#include "morph/motion.h"
#include "morph/plan.h"
#include "morph/smooth_map.h"
#include "scene/load_scene.h"
#include "sequence/prepare/load_models.h"
#include "spheres/spheres.h"

namespace polymorph {
namespace {

struct Object {
  Model model;                         ///< in its place
  std::map<std::string, Vec3> points;  ///< on its surface
  std::vector<Ball> balls;
};

/// Points of the file's coordinates, on the surface of the model in its place.
std::map<std::string, Vec3> placed(const nlohmann::json& points, const Model& file,
                                   const Model& model) {
  std::vector<Vec3> places;
  for (const auto& [name, p] : points.items()) places.push_back({p[0], p[1], p[2]});
  const std::vector<ClosestPoint> closest = ClosestPointQuery(file).closest(places);
  std::map<std::string, Vec3> result;
  std::size_t k = 0;
  for (const auto& [name, p] : points.items()) {
    const ClosestPoint& at = closest[k++];
    const auto& v = file.triangles[at.triangle].v;
    const Vec3 a = file.points[v[0]], b = file.points[v[1]], c = file.points[v[2]];
    const Vec3 normal = cross(b - a, c - a), q = at.point;
    const float area = dot(normal, normal);
    const float u = dot(cross(c - b, q - b), normal) / area,
                w = dot(cross(a - c, q - c), normal) / area;
    const auto& m = model.points;
    result[name] = m[v[0]] * u + m[v[1]] * w + m[v[2]] * (1 - u - w);
  }
  return result;
}

ObjectSettings settings_of(const nlohmann::json& model) {
  ObjectSettings settings;
  settings.model = model["model"].get<std::string>();
  settings.name = settings.model.stem();
  if (model.value("up", "y") == "z") settings.up = UpAxis::kZ;
  return settings;
}

std::pair<Object, Object> load(const nlohmann::json& from, const nlohmann::json& to) {
  Scene scene;
  scene.actors.resize(1);
  scene.actors[0].source = settings_of(from);
  scene.actors[0].target = settings_of(to);
  const auto models = load_models(scene, chain_objects(scene), false).value();
  scene.arrange = Arrange::kNone;
  scene.actors[0].source.up = scene.actors[0].target.up = UpAxis::kY;  // as in the files
  const auto files = load_models(scene, chain_objects(scene), false).value();
  std::pair<Object, Object> objects;
  for (const bool second : {false, true}) {
    Object& object = second ? objects.second : objects.first;
    object.model = models.models[second];
    const nlohmann::json& points = (second ? to : from)["points"];
    object.points = placed(points, files.models[second], object.model);
    object.balls =
        approximate_cached(object.model, SphereSettings{}, default_cache_folder(), nullptr)
            .value()
            .balls;
  }
  return objects;
}

struct Errors {
  std::vector<double> all;
  void add(Vec3 there, Vec3 wanted, float diagonal) {
    all.push_back(static_cast<double>(length(there - wanted) / diagonal));
  }
  std::string text() const {
    const auto within = [&](double limit) {
      return 100.0 *
             static_cast<double>(
                 std::count_if(all.begin(), all.end(), [&](double e) { return e < limit; })) /
             static_cast<double>(std::max<std::size_t>(all.size(), 1));
    };
    double sum = 0;
    for (const double e : all) sum += e;
    return fmt::format("{:3.0f} {:3.0f} {:.3f}", within(0.05), within(0.1),
                       sum / static_cast<double>(std::max<std::size_t>(all.size(), 1)));
  }
};

/// The mean of the targets of the ball nearest to a point.
Vec3 by_balls(Vec3 point, const std::vector<Ball>& own, const std::vector<Ball>& other,
              const MorphPlan& plan, bool back) {
  std::size_t nearest = 0;
  const auto away = [&](const Ball& b) {
    return length(b.center - point) - std::sqrt(std::max(b.w, 0.0f) / b.a);
  };
  for (std::size_t b = 1; b < own.size(); ++b)
    if (away(own[b]) < away(own[nearest])) nearest = b;
  Vec3 sum;
  for (const Pair& pair : plan.pairs)
    if ((back ? pair.to : pair.from) == nearest)
      sum =
          sum + (back ? pair.to_share : pair.from_share) * other[back ? pair.from : pair.to].center;
  return sum;
}

void measure(const std::string& name, const Object& a, const Object& b,
             const PlanSettings& settings, Engine& engine) {
  std::vector<Vec3> from, to;
  for (const auto& [key, p] : a.points)
    if (const auto at = b.points.find(key); at != b.points.end()) {
      from.push_back(p);
      to.push_back(at->second);
    }
  const auto start = std::chrono::steady_clock::now();
  const MorphPlan plan =
      plan_morph({a.balls, {}, {}}, {b.balls, {}, {}}, FieldKind::kGaussian, settings);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const float a_size = a.model.box().diagonal(), b_size = b.model.box().diagonal();
  Errors balls, map;
  for (std::size_t k = 0; k < from.size(); ++k) {
    balls.add(by_balls(from[k], plan.from, plan.to, plan, false), to[k], b_size);
    balls.add(by_balls(to[k], plan.to, plan.from, plan, true), from[k], a_size);
  }
  const auto first =
      pull_back(frame_map(plan, 0, BallSet(balls_at(plan, 0)), a_size), from, engine).value();
  const auto last =
      pull_back(frame_map(plan, 1, BallSet(balls_at(plan, 1)), b_size), to, engine).value();
  for (std::size_t k = 0; k < from.size(); ++k) {
    map.add(first.target[k], to[k], b_size);
    map.add(last.source[k], from[k], a_size);
  }
  fmt::print("{:20} {:5} points {:4}  balls {}  map {}  turn {:4.0f}  strain {:.2f}  {:.2f} s{}\n",
             name,
             settings.structure == PlanStructure::kOff ? "off"
             : plan.from_limbs.empty()                 ? "none"
                                                       : "limbs",
             from.size(), balls.text(), map.text(), plan.alignment.turn.y * 57.29578,
             plan.alignment.strain, seconds, plan.limb_names.empty() ? "" : ":");
  for (const auto& [x, y] : plan.limb_names)
    fmt::print("    {} -> {}\n", x.empty() ? "nothing" : x, y.empty() ? "nothing" : y);
}

int run(int argc, char** argv) {
  if (argc < 2) return 2;
  const nlohmann::json truth = nlohmann::json::parse(std::ifstream(argv[1]));
  const std::set<std::string> wanted(argv + 2, argv + argc);
  const auto engine = make_cpu_engine();
  for (const auto& pair : truth["pairs"]) {
    const std::string from = pair[0], to = pair[1], name = from + "-" + to;
    if (!wanted.empty() && !wanted.contains(name)) continue;
    const auto [a, b] = load(truth["models"][from], truth["models"][to]);
    for (const PlanStructure structure : {PlanStructure::kOff, PlanStructure::kAuto}) {
      PlanSettings settings;
      settings.structure = structure;
      measure(name, a, b, settings, *engine);
    }
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace
}  // namespace polymorph

int main(int argc, char** argv) { return polymorph::run(argc, argv); }
