// Mixtures of three models over a triangle of weights: mixture_bench FIRST SECOND THIRD [FOLDER].
// Prints for each of 5 x 5 mixtures (away from the first, from the second's side to the third's)
// its parts, handles, roughness over that of the rougher end, volume over the mean of the ends'
// volumes, and processor time over that of a pair's surface half way. FOLDER gets the surfaces as
// OBJ files and the balls' cache.
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

Result<WeightedSurface> mix(const ShapeSpace& space, std::span<const float> weights,
                            Engine& engine) {
  PM_TRY(const Mixture mixture, mix_objects(space, weights));
  return weighted_surface(mixture, engine);
}

int run(const std::string& first, const std::string& second, const std::string& third,
        const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  const auto object = [](const std::string& file) {
    return fmt::format(R"({{"model": "{}", "weight": 1}})", file);
  };
  const std::string scene_text =
      fmt::format(R"({{"blend": [{}, {}, {}]}})", object(first), object(second), object(third));
  const auto stop = [](const Error& error) {
    std::fprintf(stderr, "%s\n", error.message.c_str());
    return 1;
  };
  if (auto written = write_file(folder / "scene.json", scene_text); !written.ok())
    return stop(written.error());
  auto scene = load_scene(folder / "scene.json");
  if (!scene.ok()) return stop(scene.error());
  const auto engine = make_cpu_engine();
  auto prepared = prepare_scene(*scene, *engine, {folder});
  if (!prepared.ok()) return stop(prepared.error());
  const ShapeSpace& space = *prepared->actors.front().space;
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
    auto surface = mix(space, weights, *engine);
    if (!surface.ok()) return stop(surface.error());
    roughest = std::max(roughest, measure_roughness(surface->mesh, scale).tac);
  }
  std::printf("%s, %s, %s\n", ends[0]->name.c_str(), ends[1]->name.c_str(), ends[2]->name.c_str());
  std::printf("  w1    w2    w3    parts    handles curvature volume    time\n");
  constexpr int kSteps = 4;
  for (int i = 0; i <= kSteps; ++i)
    for (int j = 0; j <= kSteps; ++j) {
      const float away = static_cast<float>(i) / kSteps, side = static_cast<float>(j) / kSteps;
      const float weights[3] = {1 - away, away * (1 - side), away * side};
      const double start = seconds();
      auto surface = mix(space, weights, *engine);
      const double time = seconds() - start;
      if (!surface.ok()) return stop(surface.error());
      double volume = 0;
      for (int k = 0; k < 3; ++k)
        volume += static_cast<double>(weights[k]) * ends[k]->distances.volume;
      const Mesh& mesh = surface->mesh;
      const MeshReport report = check_mesh(mesh);
      std::printf("%5.2f %5.2f %5.2f %8d %8d %9.3f %8.3f %7.2f\n", static_cast<double>(weights[0]),
                  static_cast<double>(weights[1]), static_cast<double>(weights[2]),
                  static_cast<int>(report.components), static_cast<int>(report.genus),
                  measure_roughness(mesh, scale).tac / roughest, volume_of(mesh) / volume,
                  time / pair_time);
      const auto name = fmt::format("{}-{}.obj", i, j);
      if (auto written = write_file(folder / name, obj_text(mesh)); !written.ok())
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
