#include "sequence/render_frame.h"

#include <vector>

#include "base/text.h"
#include "morph/timeline.h"
#include "sequence/film.h"
#include "sequence/render_scene.h"

namespace polymorph {
namespace {

std::vector<Attribute> header_of(const PreparedScene& prepared, int frame, const std::string& isa,
                                 const std::string& device, const std::string& command) {
  std::vector<Attribute> attributes{
      {"Software", std::string("polymorph ") + PM_VERSION},
      {"FramesPerSecond", prepared.scene.frames.fps},
      {"polymorph/version", std::string(PM_VERSION)},
      {kHashAttribute, prepared.hash},
      {kFrameHashAttribute, frame_hash(prepared, frame)},
      {kFrameAttribute, frame},
      {"polymorph/t", sequence_time(prepared.scene, shown_frame(prepared.scene, frame))},
      {"polymorph/stage", stage_names(prepared, frame)},
      {"polymorph/device", device},
      {"polymorph/isa", isa},
      {"polymorph/samples", prepared.scene.image.samples},
      {"polymorph/exposure", scene_at(prepared.scene, static_cast<double>(frame)).image.exposure},
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

void put_header(Image& image, const PreparedScene& prepared, int frame, const std::string& isa,
                const std::string& device, const std::string& command) {
  std::vector<Attribute> header = header_of(prepared, frame, isa, device, command);
  // What says how to read the picture's mattes stays.
  for (Attribute& attribute : image.attributes)
    if (attribute.name.starts_with("cryptomatte/")) header.push_back(std::move(attribute));
  image.attributes = std::move(header);
}

Result<Image> render_frame(const PreparedScene& prepared, const FrameGeometry& geometry,
                           Renderer& renderer, const std::string& device,
                           const std::string& command) {
  RenderSettings settings;
  settings.image = prepared.scene.image;
  settings.frame = geometry.frame;
  PM_TRY(Image image, renderer.render(render_scene(prepared, geometry), settings));
  put_header(image, prepared, geometry.frame, renderer.isa(), device, command);
  return image;
}

}  // namespace polymorph
