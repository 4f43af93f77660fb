#include "cli/scene_options.h"

#include <algorithm>

#include "morph/timeline.h"
#include "scene/load_scene.h"

namespace polymorph {
namespace {

/// A fit that takes a tenth of the time. What is to have no fit stays as it is.
void make_coarse(const Scene& scene, SphereSettings& spheres) {
  constexpr int kBalls = 64;
  if (!is_fitted(scene, spheres)) return;
  spheres.coarse = true;
  spheres.balls = std::min(spheres.balls, kBalls);
  spheres.error = 0;
  spheres.resolution = 0;
}

/// Half size, coarser surface and balls, direct light and a ray for what hides the sky.
void make_preview(Scene& scene) {
  for (ActorSettings& actor : scene.actors) {
    make_coarse(scene, actor.source.spheres);
    for (ObjectSettings& object : actor.intermediate) make_coarse(scene, object.spheres);
    make_coarse(scene, actor.target.spheres);
  }
  scene.image.width = std::max(1, scene.image.width / 2);
  scene.image.height = std::max(1, scene.image.height / 2);
  scene.image.samples = std::min(scene.image.samples, 2);
  scene.image.noise = 0;
  scene.image.max_depth = 1;
  scene.surface.resolution = std::max(8, scene.surface.resolution / 2);
}

}  // namespace

void add_scene_options(Command command, SceneOptions& options) {
  command
      .add_flag("--preview", options.preview,
                "half size, coarse balls and surface, direct light only")
      .group("Main");
  command.add_option("--spp", options.samples, "samples per pixel")
      .range(1, 65536)
      .type_name("N")
      .group("Scene");
  command
      .add_option("--noise", options.noise,
                  "sample until the error is below this, as 0.01; at most --spp")
      .range(0.0, 1.0)
      .type_name("E")
      .group("Scene");
  command
      .add_flag("--denoise", options.denoise,
                "clean the colours with Open Image Denoise, where it is installed")
      .group("Scene");
  command
      .add_option("--aovs", options.aovs,
                  "layers of the EXR: Z, N, P, albedo, uv, motion, morph, label, id, "
                  "crypto_object, crypto_material, crypto_label, all or none; commas between")
      .type_name("LAYERS")
      .group("Scene");
  command.add_option("--seed", options.seed, "seed of the sampling noise")
      .range(0LL, 9007199254740991LL)
      .type_name("N")
      .group("Scene");
  add_overrides(command, options.sets);
  command
      .add_option("--isa", options.isa,
                  "Embree's instruction set: sse2, sse4.2, avx, avx2 or avx512; default: the "
                  "best. All give the same pixels")
      .environment("POLYMORPH_ISA")
      .type_name("NAME")
      .group("Farm");
}

Result<std::vector<Override>> overrides_of(const SceneOptions& options) {
  PM_TRY(std::vector<Override> overrides, parse_overrides(options.sets));
  if (!options.aovs.empty())
    overrides.emplace_back("image.aovs", fmt::format("\"{}\"", options.aovs));
  return overrides;
}

void apply_scene_options(Scene& scene, const SceneOptions& options) {
  if (options.preview) make_preview(scene);
  if (options.samples > 0) scene.image.samples = options.samples;
  if (options.noise >= 0) scene.image.noise = static_cast<float>(options.noise);
  if (options.denoise) scene.image.denoise = true;
  if (options.seed >= 0) scene.image.seed = static_cast<std::uint64_t>(options.seed);
}

Result<Scene> load_scene_with(const std::string& file, const SceneOptions& options) {
  PM_TRY(const std::vector<Override> overrides, overrides_of(options));
  PM_TRY(Scene scene, load_scene(file, overrides));
  apply_scene_options(scene, options);
  return scene;
}

std::vector<std::string> to_arguments(const SceneOptions& options) {
  std::vector<std::string> words;
  const auto add = [&](const char* name, const std::string& value) {
    words.emplace_back(name);
    words.push_back(value);
  };
  if (options.preview) words.emplace_back("--preview");
  if (options.samples > 0) add("--spp", fmt::format("{}", options.samples));
  if (options.noise >= 0) add("--noise", fmt::format("{}", options.noise));
  if (options.denoise) words.emplace_back("--denoise");
  if (!options.aovs.empty()) add("--aovs", options.aovs);
  if (options.seed >= 0) add("--seed", fmt::format("{}", options.seed));
  for (const std::string& set : options.sets) add("--set", set);
  if (!options.isa.empty()) add("--isa", options.isa);
  return words;
}

}  // namespace polymorph
