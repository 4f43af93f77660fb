#include "farm/reproduce.h"

#include <cstring>

#include "base/file.h"
#include "base/program_identity.h"
#include "base/sha256.h"
#include "base/text.h"
#include "compare/compare.h"
#include "device/device.h"
#include "film/frame_files.h"
#include "image/attributes.h"
#include "image/display_view.h"
#include "image/image_io.h"
#include "morph/timeline.h"
#include "scene/provenance.h"
#include "sequence/frame/frame_geometry.h"
#include "sequence/frame/render_frame.h"
#include "sequence/prepare/engine_scene.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// Reads the pixels as the file stores them, without a conversion of the colour space.
constexpr ReadImageSettings kAsStored{.single_picture = true, .stored_colors = true};

/// A frame's file and the contents of its header.
struct FrameFile {
  std::string name;  ///< file name, for messages
  std::string bytes;
  bool is_png = false;
  Image image;
  std::string encoded_provenance;  ///< value of kProvenanceAttribute
  Provenance provenance;
  int frame = 0;
};

/// Reads a frame and its header. Errors (kInput): the header lacks what a reproduction needs.
Result<FrameFile> read_frame(const fs::path& file) {
  FrameFile out;
  out.name = file.string();
  remember_input(file);
  PM_TRY(out.bytes, read_file(file));
  out.is_png = out.bytes.starts_with("\x89PNG");
  PM_TRY(out.image, decode_image(out.bytes, out.name, kAsStored));
  if (format_entry(out.image, kPartOfAttribute))
    return make_error(ErrorCode::kInput,
                      "{}: it holds some of the frame's samples - merge the parts, and reproduce "
                      "what comes out",
                      out.name);
  if (format_entry(out.image, kViewAttribute))
    return make_error(
        ErrorCode::kInput,
        "{}: it was made by a view of $OCIO, whose config no header holds - reproduce "
        "the EXR of the frame",
        out.name);
  const auto encoded_provenance = format_entry(out.image, kProvenanceAttribute);
  if (!encoded_provenance)
    return make_error(ErrorCode::kInput,
                      "{}: its header has no {} - render and golden write it; it is lost where "
                      "another program writes the frame anew",
                      out.name, kProvenanceAttribute);
  out.encoded_provenance = *encoded_provenance;
  auto provenance = decode_provenance(out.encoded_provenance);
  if (!provenance)
    return make_error(ErrorCode::kInput, "{}: {}", out.name, provenance.error().message);
  out.provenance = std::move(*provenance);
  const auto number = parse_integer(format_entry(out.image, kFrameAttribute).value_or(""));
  // The limit keeps the cast below in range; reproduce_frame() checks that the scene has the frame.
  if (!number || *number < 1 || *number > 10'000'000)
    return make_error(ErrorCode::kInput, "{}: its header has no {}", out.name, kFrameAttribute);
  out.frame = static_cast<int>(*number);
  return out;
}

/// Compares the input files in `folder` with the digests in the header. Adds the differences to
/// `result`. Skips entries for several files: reproduce_frame() compares these later, when the
/// preparation of the scene has read the files.
void check_inputs(const Provenance& provenance, const fs::path& folder, Reproduction& result) {
  for (const InputFile& input : provenance.files) {
    if (input.count > 1 || input.name == kAllFiles) continue;
    const auto bytes = read_file(folder / input.name);
    if (!bytes) {
      result.missing.push_back(bytes.error().message);
      continue;
    }
    const InputFile current_file{input.name, Sha256().add(bytes->data(), bytes->size()).hex()};
    for (std::string& line : compare_inputs({&input, 1}, {&current_file, 1}))
      result.changed.push_back(std::move(line));
  }
}

/// Tests whether the header describes AOV layers. If the frame was written only as a PNG, it was
/// rendered without layers, and its header does not describe any.
bool describes_layers(const Image& image) {
  for (const Attribute& attribute : image.attributes)
    if (attribute.name == "polymorph/labels" || attribute.name.starts_with("cryptomatte/"))
      return true;
  return false;
}

/// Renders the frame and encodes it with the isa, device and command of the original header.
Result<std::string> render_again(const FrameFile& original, const PreparedScene& prepared,
                                 Engine& engine, Renderer& renderer) {
  PM_TRY(const FrameGeometry geometry, geometry_at(prepared, engine, original.frame));
  PM_TRY(Image image, render_frame(prepared, geometry, renderer, /*device=*/"", /*command=*/""));
  const auto entry = [&](const char* name) {
    return format_entry(original.image, name).value_or("");
  };
  put_header(prepared, original.frame,
             {entry(kIsaAttribute), entry(kDeviceAttribute), entry(kCommandAttribute)}, image);
  return original.is_png ? encode_png(image, png_settings(prepared.scene, original.frame))
                         : encode_exr(image, exr_settings(prepared.scene));
}

/// Compares the original with `rendered`, the image in `result.bytes`. Sets same_pixels, same_bytes
/// and difference.
void compare_frames(const FrameFile& original, const Image& rendered, Reproduction& result) {
  const Image& expected = original.image;
  result.same_bytes = original.bytes == result.bytes;
  result.same_pixels = rendered.width == expected.width && rendered.height == expected.height &&
                       rendered.channels == expected.channels &&
                       std::memcmp(rendered.pixels.data(), expected.pixels.data(),
                                   rendered.pixels.size() * sizeof(float)) == 0;
  if (result.same_pixels) return;
  const Comparison comparison = compare_images(rendered, expected, zero_tolerance());
  result.difference = comparison.verdict == Verdict::kSame
                          ? "the pixels have equal values, but not the same bits"
                          : comparison.reason;
}

}  // namespace

Result<Reproduction> reproduce_frame(const fs::path& file, const fs::path& models,
                                     const Resources& resources) {
  PM_TRY(const FrameFile original, read_frame(file));
  const Provenance& provenance = original.provenance;
  Reproduction result;
  result.frame = original.frame;
  result.program = fmt::format("{} ({})", provenance.version, provenance.program);
  result.same_program =
      provenance.version == program_version() && provenance.program == shared_identity();
  std::error_code error;
  // Check the input files. A trailing slash, as in "models/", is removed from the folder.
  fs::path folder = fs::absolute(models, error).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();
  if (!fs::is_directory(folder, error))
    return make_error(ErrorCode::kInput, "{}: no such folder", models.string());
  check_inputs(provenance, folder, result);
  if (!result.missing.empty() || !result.changed.empty()) return result;
  auto loaded = load_provenance_scene(provenance, folder, file.filename().string());
  if (!loaded)
    return make_error(ErrorCode::kInput, "{}: {}", original.name, loaded.error().message);
  const Scene& scene = *loaded;
  if (const int count = frame_count(scene); original.frame > count)
    return make_error(ErrorCode::kInput, "{}: its header says frame {}, and its scene has {}",
                      original.name, original.frame, count);
  // Two pictures are in memory: the original and the rendered one.
  PM_TRY_STATUS(check_picture_memory(scene.image, /*pictures=*/2, resources.max_memory));
  PM_TRY(EngineScene engine_scene, prepare_on_engine(scene, resources, /*pictures=*/2));
  PreparedScene& prepared = engine_scene.prepared;
  // The preparation has read all files, so entries for several files can be compared, too.
  result.changed = compare_inputs(provenance.files, name_files(prepared.inputs, {{folder}}));
  if (!result.changed.empty()) return result;
  if (original.is_png && !describes_layers(original.image)) prepared.scene.image.aovs = "none";
  prepared.provenance = original.encoded_provenance;
  PM_TRY(Renderer renderer, make_renderer(engine_scene.device, resources.max_memory));
  PM_TRY(result.bytes, render_again(original, prepared, *engine_scene.engine, renderer));
  PM_TRY(const Image rendered, decode_image(result.bytes, "the frame as rendered now", kAsStored));
  compare_frames(original, rendered, result);
  return result;
}

}  // namespace polymorph
