// Mixtures of three models over a triangle of weights: mixture_bench FIRST SECOND THIRD [FOLDER].
// Prints for each of 15 mixtures its parts, handles, roughness over that of the rougher end, volume
// over the mean of the ends' volumes, and processor time over that of a pair's surface half way.
// FOLDER gets the surfaces as OBJ files and the balls' cache.
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <string>

#include <fmt/format.h>

#include "analyze/roughness.h"
#include "base/file.h"
#include "leg/leg_surface.h"
#include "leg/weighted_surface.h"
#include "mesh/components.h"
#include "mesh/mesh_check.h"
#include "scene/load_scene.h"
#include "sequence/prepare/prepare.h"

namespace polymorph {
namespace {

double seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

std::string obj_text(const Mesh& mesh) {
  std::string text;
  for (const Vec3 p : mesh.positions) text += fmt::format("v {} {} {}\n", p.x, p.y, p.z);
  for (const Triangle& t : mesh.triangles)
    text += fmt::format("f {} {} {}\n", t.v[0] + 1, t.v[1] + 1, t.v[2] + 1);
  return text;
}

int run(const std::string& first, const std::string& second, const std::string& third,
        const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  const auto actor = [&](const std::string& target) {
    return fmt::format(R"({{"source": "{}", "target": "{}"}})", first, target);
  };
  const std::string scene_text = fmt::format(R"({{"actors": [{}, {}], "frames": {{"count": 3}}}})",
                                             actor(second), actor(third));
  const auto stop = [](const Error& error) {
    std::fprintf(stderr, "%s\n", error.message.c_str());
    return 1;
  };
  if (auto written = write_file(folder / "scene.json", scene_text); !written.ok())
    return stop(written.error());
  auto scene = load_scene(folder / "scene.json");
  if (!scene.ok()) return stop(scene.error());
  const auto engine = make_cpu_engine();
  auto prepared = prepare_scene(*scene, *engine, folder);
  if (!prepared.ok()) return stop(prepared.error());
  ShapeSpace space;
  for (const PreparedActor& one : prepared->actors) space.legs.push_back(one.legs.at(0));
  const PreparedObject* ends[3] = {space.legs[0]->from.get(), space.legs[0]->to.get(),
                                   space.legs[1]->to.get()};
  Box box = ends[0]->model.box();
  for (const PreparedObject* end : ends) box = unite(box, end->model.box());
  const RoughnessScale scale = roughness_scale(box);
  double pair_time = seconds();
  for (const auto& leg : space.legs)
    if (auto half = leg_surface(*leg, 0.5f, *engine); !half.ok()) return stop(half.error());
  pair_time = (seconds() - pair_time) / 2;
  double roughest = 0;
  for (int i = 0; i < 3; ++i) {
    float weights[3] = {0, 0, 0};
    weights[i] = 1;
    auto mesh = weighted_surface(space, weights, *engine);
    if (!mesh.ok()) return stop(mesh.error());
    roughest = std::max(roughest, measure_roughness(*mesh, scale).tac);
  }
  std::printf("  w1    w2    w3    parts    handles curvature volume    time\n");
  constexpr int kSteps = 4;
  for (int i = 0; i <= kSteps; ++i)
    for (int j = 0; i + j <= kSteps; ++j) {
      const float weights[3] = {static_cast<float>(i) / kSteps, static_cast<float>(j) / kSteps,
                                static_cast<float>(kSteps - i - j) / kSteps};
      const double start = seconds();
      auto mesh = weighted_surface(space, weights, *engine);
      const double time = seconds() - start;
      if (!mesh.ok()) return stop(mesh.error());
      double volume = 0;
      for (int k = 0; k < 3; ++k)
        volume += static_cast<double>(weights[k]) * ends[k]->distances.volume;
      const MeshReport report = check_mesh(*mesh);
      std::printf("%5.2f %5.2f %5.2f %8d %8d %9.3f %8.3f %7.2f\n", static_cast<double>(weights[0]),
                  static_cast<double>(weights[1]), static_cast<double>(weights[2]),
                  static_cast<int>(report.components), static_cast<int>(report.genus),
                  measure_roughness(*mesh, scale).tac / roughest, volume_of(*mesh) / volume,
                  time / pair_time);
      const auto name = fmt::format("{}-{}-{}.obj", i, j, kSteps - i - j);
      if (auto written = write_file(folder / name, obj_text(*mesh)); !written.ok())
        return stop(written.error());
    }
  return 0;
}

}  // namespace
}  // namespace polymorph

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "Usage: mixture_bench FIRST SECOND THIRD [FOLDER]\n");
    return 1;
  }
  const auto absolute = [&](int i) { return std::filesystem::absolute(argv[i]).string(); };
  return polymorph::run(absolute(1), absolute(2), absolute(3),
                        argc > 4 ? std::filesystem::absolute(argv[4]) : "mixtures");
}
