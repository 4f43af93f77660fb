#include "sequence/render_frame.h"

#include <vector>

#include "base/text.h"
#include "sequence/render_scene.h"

namespace polymorph {
namespace {

std::vector<Attribute> header_of(const PreparedScene& prepared, const FrameGeometry& geometry,
                                 const Renderer& renderer, const std::string& device,
                                 const std::string& command) {
  std::vector<Attribute> attributes{
      {"Software", std::string("polymorph ") + PM_VERSION},
      {"FramesPerSecond", prepared.scene.frames.fps},
      {"polymorph/version", std::string(PM_VERSION)},
      {kHashAttribute, prepared.hash},
      {kFrameAttribute, geometry.frame},
      {"polymorph/t", geometry.t},
      {"polymorph/stage", geometry.stage},
      {"polymorph/device", device},
      {"polymorph/isa", renderer.isa()},
      {"polymorph/samples", prepared.scene.image.samples},
      {"polymorph/exposure", prepared.scene.image.exposure},
      {"polymorph/seed", fmt::format("{}", prepared.scene.image.seed)}};
  if (aov_is_chosen(prepared.scene.image.aovs, "label")) {
    std::string names;
    int number = 0;
    for (const PreparedActor& actor : prepared.actors)
      for (const std::string& name : actor.label_names)
        names += fmt::format("{}{} {}{}", names.empty() ? "" : ", ", ++number,
                             prepared.actors.size() > 1 ? actor.name + "." : "", name);
    attributes.push_back({"polymorph/labels", names});
  }
  if (!command.empty()) attributes.push_back({"polymorph/command", printable(command)});
  return attributes;
}

}  // namespace

Result<Image> render_frame(const PreparedScene& prepared, const FrameGeometry& geometry,
                           Renderer& renderer, const std::string& device,
                           const std::string& command) {
  RenderSettings settings;
  settings.image = prepared.scene.image;
  settings.frame = geometry.frame;
  PM_TRY(Image image, renderer.render(render_scene(prepared, geometry), settings));
  image.attributes = header_of(prepared, geometry, renderer, device, command);
  return image;
}

}  // namespace polymorph
