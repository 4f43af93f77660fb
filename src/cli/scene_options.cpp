#include "cli/scene_options.h"

#include <algorithm>
#include <string_view>

#include "scene/load_scene.h"

namespace polymorph {
namespace {

/// Makes the fit of an object's balls about ten times as fast. Objects without a fit stay as they
/// are.
void make_coarse(const Scene& scene, SphereSettings& spheres) {
  constexpr int kMaxCoarseBalls = 64;
  if (!is_fitted(scene, spheres)) return;
  spheres.coarse = true;
  spheres.balls = std::min(spheres.balls, kMaxCoarseBalls);
  spheres.error = 0;       // `balls` gives the number of balls
  spheres.resolution = 0;  // chosen for this number
}

/// Tests whether smoothing makes up for a second sample in all frames. What a lens or a shutter
/// blurs is not smoothed, and neither is the alpha of transparent pictures.
bool needs_only_one_sample(const Scene& scene) {
  const auto is_keyed = [&](std::string_view pointer) {
    return std::ranges::any_of(
        scene.tracks, [&](const KeyframeTrack& track) { return track.pointer == pointer; });
  };
  const bool blurs = scene.camera.aperture > 0 || scene.camera.shutter > 0 ||
                     is_keyed("/camera/aperture") || is_keyed("/camera/shutter");
  return scene.image.smooth && !scene.image.denoise && !blurs && !scene.image.transparent &&
         !scene.ground.shadow_only;
}

/// Applies --preview: half the size, a coarser surface and fewer balls; one sample of direct light
/// and one ambient-occlusion ray, smoothed. `draft` applies --draft: a still coarser surface, and
/// one sample of direct light without noise. Settings of the image other than its size keep the
/// values that --set (`sets`) gives them.
void make_preview(Scene& scene, const std::vector<std::string>& sets, bool draft) {
  for (ActorSettings& actor : scene.actors)
    for_each_object(actor, [&](ObjectSettings& object) { make_coarse(scene, object.spheres); });
  scene.image.width = std::max(1, scene.image.width / 2);
  scene.image.height = std::max(1, scene.image.height / 2);
  const auto is_not_set = [&](std::string_view key) {
    return std::ranges::none_of(sets, [&](const std::string& set) { return set.starts_with(key); });
  };
  if (is_not_set("image.noise=")) scene.image.noise = 0;
  if (is_not_set("image.max_depth=")) scene.image.max_depth = draft ? 0 : 1;
  if (is_not_set("image.smooth=")) scene.image.smooth = !draft;
  if (draft && is_not_set("image.denoise=")) scene.image.denoise = false;
  if (is_not_set("image.samples="))
    scene.image.samples =
        std::min(scene.image.samples, draft || needs_only_one_sample(scene) ? 1 : 2);
  // 7/16 of the cells give a picture 2 % further from that of a fine surface than half of them do,
  // in 0.9 of the time; 3/8 give one 11 % further. 8 is the minimum (scene/describe.h).
  scene.surface.resolution = std::max(8, scene.surface.resolution * (draft ? 6 : 7) / 16);
}

}  // namespace

void add_scene_options(Command command, SceneOptions& options) {
  command.add_flag("--preview", options.preview,
                   "half size, coarse balls and surface, direct light only, its noise smoothed");
  command
      .add_flag(
          "--draft", options.draft,
          "a preview in half the time: a coarser surface, one sample of direct light from the "
          "lights' centres, and a sky that nothing hides")
      .excludes(command.option("--preview"));
  command.add_option("--spp", options.samples, "N", "samples per pixel")
      .range(1, 65536)
      .group("Scene");
  command
      .add_option("--display", options.view.display, "NAME",
                  "display of $OCIO's config that PNGs, strips, GIFs and movies are made for")
      .group("Scene");
  command
      .add_option("--view", options.view.view, "NAME", "view of that display; default: its first")
      .group("Scene");
  add_overrides(command, options.sets);
}

void apply_scene_options(Scene& scene, const SceneOptions& options) {
  if (options.preview || options.draft) make_preview(scene, options.sets, options.draft);
  if (options.samples > 0) scene.image.samples = options.samples;
}

Result<Scene> load_scene_with(const std::string& file, const SceneOptions& options) {
  PM_TRY(const std::vector<Override> overrides, parse_overrides(options.sets));
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
  if (options.draft) words.emplace_back("--draft");
  if (options.samples > 0) add("--spp", fmt::format("{}", options.samples));
  if (!options.view.display.empty()) add("--display", options.view.display);
  if (!options.view.view.empty()) add("--view", options.view.view);
  for (const std::string& set : options.sets) add("--set", set);
  return words;
}

}  // namespace polymorph
