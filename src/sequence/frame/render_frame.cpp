#include "sequence/frame/render_frame.h"

#include <algorithm>
#include <string>
#include <vector>

#include "base/hash.h"
#include "base/program_identity.h"
#include "base/text.h"
#include "compare/explain.h"
#include "morph/timeline.h"
#include "render/film/part.h"
#include "scene/provenance.h"
#include "sequence/frame/render_scene.h"
#include "sequence/prepare/film_settings.h"

namespace polymorph {
namespace {

std::string camera_text(const Camera& camera) {
  return pinhole_view_text({camera.position, camera.forward, camera.up, camera.tan_half_fov_y});
}

/// Computes a digest of the correspondence of balls on all legs.
std::string plan_digest(const PreparedScene& prepared) {
  Hasher hasher;
  for (const PreparedActor& actor : prepared.actors)
    for (const auto& leg : actor.legs) {
      hasher.add(leg->plan.pairs.size());
      for (const auto& pair : leg->plan.pairs)
        hasher.add(pair.from).add(pair.to).add(pair.from_share).add(pair.to_share);
    }
  return hasher.hex();
}

/// Lists the number of balls of each object: "teapot 96, penguin 96".
std::string ball_counts(const PreparedScene& prepared) {
  std::string counts;
  for (const PreparedActor& actor : prepared.actors)
    for (const auto& object : actor.objects) {
      std::string name = object->name;
      std::replace(name.begin(), name.end(), ',', ' ');
      counts +=
          fmt::format("{}{} {}", counts.empty() ? "" : ", ", printable(name), object->balls.size());
    }
  return counts;
}

/// Lists the meanings of the ids that render_scene() assigns, an actor's surface before its
/// objects: "2 teapot to penguin, 3 teapot, 4 penguin".
std::string object_names(const PreparedScene& prepared) {
  std::string names;
  int id = 2;  // kFirstId of render_scene.cpp
  const auto add = [&](const std::string& actor, std::string name) {
    if (prepared.actors.size() > 1) name = actor + "." + name;
    std::replace(name.begin(), name.end(), ',', ' ');
    names += fmt::format("{}{} {}", names.empty() ? "" : ", ", id++, printable(name));
  };
  for (const PreparedActor& actor : prepared.actors) {
    std::string chain;
    for (const auto& object : actor.objects) chain += (chain.empty() ? "" : " to ") + object->name;
    add(actor.name, chain);
    for (const auto& object : actor.objects) add(actor.name, object->name);
  }
  return names;
}

/// Makes the attributes of a frame's header.
std::vector<Attribute> make_header(const PreparedScene& prepared, int frame,
                                   const FrameOrigin& origin) {
  std::vector<Attribute> attributes{
      {"Software", fmt::format("polymorph {}", program_version())},
      {"FramesPerSecond", prepared.scene.frames.fps},
      {"polymorph/version", std::string(program_version())},
      {kHashAttribute, prepared.hashes.scene},
      {kFrameHashAttribute, frame_hash(prepared.scene, prepared.hashes, frame)},
      {kFrameAttribute, frame},
      {"polymorph/t", sequence_time(prepared.scene, shown_frame(prepared.scene, frame))},
      {"polymorph/stage", stage_names(prepared, frame)},
      {kDeviceAttribute, origin.device},
      {kIsaAttribute, origin.isa},
      {kSamplesAttribute, prepared.scene.image.samples},
      {"polymorph/exposure", scene_at(prepared.scene, static_cast<double>(frame)).image.exposure},
      {kSeedAttribute, fmt::format("{}", prepared.scene.image.seed)},
      {kCameraAttribute, camera_text(make_frame_view(prepared, frame).camera)},
      {kBallsAttribute, ball_counts(prepared)},
      {kPlanAttribute, plan_digest(prepared)},
      {kObjectsAttribute, object_names(prepared)}};
  if (includes_aov(prepared.scene.image.aovs, "label")) {
    std::string names;
    int number = 0;
    for (const PreparedActor& actor : prepared.actors)
      for (const std::string& name : actor.label_names)
        names += fmt::format("{}{} {}{}", names.empty() ? "" : ", ", ++number,
                             prepared.actors.size() > 1 ? actor.name + "." : "", name);
    attributes.push_back({"polymorph/labels", names});
  }
  if (!prepared.provenance.empty())
    attributes.push_back({kProvenanceAttribute, prepared.provenance});
  if (!origin.command.empty()) attributes.push_back({kCommandAttribute, printable(origin.command)});
  return attributes;
}

/// Turns a frame's header into the header of one of its parts, which names the frame and says how
/// the merged frame must be written.
void make_part_header(const OutputSettings& output, std::vector<Attribute>& header) {
  for (Attribute& attribute : header)
    if (attribute.name == kFrameHashAttribute) attribute.name = kPartOfAttribute;
  if (output.color_space != ColorSpace::kRec709)
    header.push_back({kPartColorSpaceAttribute, color_space_label(output.color_space).interop_id});
  if (output.multipart) header.push_back({kPartMultipartAttribute, 1});
}

/// Adds the members of a state that decide how an actor looks.
void add(Hasher& key, const MorphState& m) {
  key.add(m.leg).add(static_cast<int>(m.stage)).add(m.progress).add(m.time).add(m.object);
  key.add(m.look).add(m.boundary).add(m.growth).add(std::span<const float>(m.weights));
  key.add(shows_source(m) ? m.mesh : -1).add(shows_target(m) ? m.to_mesh : -1);
}

}  // namespace

std::string picture_key(const PreparedScene& prepared, int frame) {
  const Scene& scene = prepared.scene;
  // Noise that is not steady, or a turntable's camera, makes every frame different.
  if (!scene.image.steady || scene.frames.turntable > 0) return "";
  const bool flows = needs_motion(scene_at(scene, static_cast<double>(frame)));
  Hasher key;
  key.add(frame_hash(scene, prepared.hashes, frame)).add(sequence_time(scene, frame));
  for (const PreparedActor& actor : prepared.actors) {
    // A frame that differs from both its neighbours has no pixels in common with another.
    if (differs_from_neighbours(actor.timeline, frame)) return "";
    add(key, morph_state_at(actor.timeline, frame));
    // Motion vectors depend on the next frame, too.
    if (flows) add(key, morph_state_at(actor.timeline, std::min(frame + 1, actor.timeline.count)));
  }
  return make_frame_view(prepared, frame).camera_motion ? "" : key.hex();
}

Status check_picture_memory(const ImageSettings& image, std::size_t pictures, std::uint64_t limit,
                            const std::optional<SampleRange>& part) {
  const std::uint64_t bytes = pictures * picture_bytes(image, part);
  if (limit == 0 || bytes <= limit) return Ok{};
  return make_error(ErrorCode::kResource,
                    "{} of {} x {} need{} {}, and the limit is {} - lower image.width and "
                    "image.height, image.aovs or --jobs, or raise --max-memory",
                    pictures == 1 ? "a picture" : fmt::format("{} pictures at once", pictures),
                    image.width, image.height, pictures == 1 ? "s" : "",
                    format_bytes(static_cast<double>(bytes)),
                    format_bytes(static_cast<double>(limit)));
}

void put_header(const PreparedScene& prepared, int frame, const FrameOrigin& origin, Image& image) {
  std::vector<Attribute> header = make_header(prepared, frame, origin);
  // Keep the entries that describe mattes and those that are needed to merge a part.
  bool is_part = false;
  for (Attribute& attribute : image.attributes) {
    const bool is_for_merge = attribute.name.starts_with(kPartPrefix) &&
                              attribute.name != kPartColorSpaceAttribute &&
                              attribute.name != kPartMultipartAttribute;
    is_part = is_part || is_for_merge;
    if (is_for_merge || attribute.name.starts_with("cryptomatte/"))
      header.push_back(std::move(attribute));
  }
  if (is_part) make_part_header(prepared.scene.output, header);
  image.attributes = std::move(header);
}

Result<Image> render_samples(const PreparedScene& prepared, const FrameSamples& samples,
                             Renderer& renderer, const FrameOrigin& origin) {
  RenderSettings settings;
  settings.image = prepared.scene.image;
  settings.frame = samples.geometry.frame;
  settings.part = samples.part;
  PM_TRY(Image image, renderer.render(render_scene(prepared, samples.geometry), settings));
  put_header(prepared, samples.geometry.frame, {renderer.isa(), origin.device, origin.command},
             image);
  return image;
}

Result<Image> render_frame(const PreparedScene& prepared, const FrameGeometry& geometry,
                           Renderer& renderer, const std::string& device,
                           const std::string& command) {
  return render_samples(prepared, {geometry, std::nullopt}, renderer, {"", device, command});
}

}  // namespace polymorph
