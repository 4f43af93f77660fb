#include <algorithm>
#include <cmath>

#include "base/file.h"
#include "base/log.h"
#include "cli/command_line.h"
#include "cli/numbers.h"
#include "cli/progress.h"
#include "image/image_io.h"
#include "image/movie.h"
#include "image/strip.h"
#include "morph/timeline.h"
#include "sequence/frames.h"
#include "sequence/render_sequence.h"

namespace polymorph {
namespace {

struct StripOptions {
  std::string input, output, gif, mp4, label = "frame", frames;
  int count = 8, columns = 4, width = 0;
  bool moves() const { return !gif.empty() || !mp4.empty(); }
  float fps = 0;
  std::vector<std::string> sets;
};

/// What a sheet is made of.
struct Frames {
  std::vector<int> numbers;
  std::vector<Image> images;
  float fps = 12;
  int first = 1, last = 1;  ///< of the whole sequence, for labels in t
};

/// The scene's exposure, which EXR frames leave to whoever shows them; PNG frames already have it.
void expose(Image& image, float stops) {
  if (stops == 0) return;
  const float factor = std::exp2(stops);
  for (const char* name : {"R", "G", "B"}) {
    const int channel = image.find_channel(name);
    for (std::size_t i = static_cast<std::size_t>(std::max(channel, 0));
         channel >= 0 && i < image.pixels.size(); i += image.channel_count())
      image.pixels[i] *= factor;
  }
}

/// Only what a sheet needs, at its size: a long sequence is held in memory as a whole.
Image slim(const Image& image, int width) {
  std::vector<std::string> names;
  for (const char* name : {"R", "G", "B", "A"})
    if (image.find_channel(name) >= 0) names.emplace_back(name);
  Image colors = make_image(image.width, image.height, names);
  for (std::size_t c = 0; c < names.size(); ++c) {
    const auto from = static_cast<std::size_t>(image.find_channel(names[c]));
    for (std::size_t i = c, k = from; i < colors.pixels.size();
         i += names.size(), k += image.channel_count())
      colors.pixels[i] = image.pixels[k];
  }
  if (width == 0 || names.empty()) return colors;
  return resize_image(colors, width, std::max(1, width * image.height / image.width));
}

/// n of the numbers, evenly spread, first and last included.
std::vector<int> spread(const std::vector<int>& numbers, int n) {
  if (n >= static_cast<int>(numbers.size())) return numbers;
  std::vector<int> chosen;
  for (int i = 0; i < n; ++i) {
    const double at =
        n == 1 ? 0.5 * static_cast<double>(numbers.size() - 1)
               : static_cast<double>(i) * static_cast<double>(numbers.size() - 1) / (n - 1);
    chosen.push_back(numbers[static_cast<std::size_t>(std::lround(at))]);
  }
  return chosen;
}

Result<Frames> from_scene(const CommandLine& line, const StripOptions& options) {
  PM_TRY(const std::vector<Override> overrides, parse_overrides(options.sets));
  PM_TRY(Scene scene, load_scene(options.input, overrides));
  Frames frames;
  const int count = frame_count(scene);
  PM_TRY(
      frames.numbers,
      parse_frames(options.frames.empty() ? fmt::format("1-{}", count) : options.frames, 1, count));
  if (!options.moves() && options.frames.empty())
    frames.numbers = spread(frames.numbers, options.count);
  frames.last = count;
  frames.fps = scene.frames.fps;
  std::string device;
  PM_TRY(const auto extractor, make_extractor(line.common.device, device, line.common.max_memory));
  PM_TRY(const PreparedScene prepared, prepare_scene(scene, *extractor, cache_folder(line.common)));
  for (const std::string& warning : prepared.warnings) log_warning("{}", warning);
  PM_TRY(Renderer renderer, Renderer::create());
  const ProgressCallback progress = make_progress(progress_mode(line.common));
  for (std::size_t i = 0; i < frames.numbers.size(); ++i) {
    if (stop_requested()) return make_error(stop_code(), "stopped - nothing was written");
    PM_TRY(const FrameGeometry geometry, geometry_at(prepared, *extractor, frames.numbers[i]));
    PM_TRY(Image image, render_frame(prepared, geometry, renderer, device, line.text));
    expose(image, scene_at(scene, static_cast<double>(frames.numbers[i])).image.exposure);
    frames.images.push_back(slim(image, options.width));
    FrameRecord record;
    record.frame = frames.numbers[i];
    record.state = FrameRecord::State::kDone;
    progress(i + 1, frames.numbers.size(), record);
  }
  return frames;
}

/// A header's rate, which EXR keeps as a number and PNG as text.
std::optional<float> fps_of(const Attribute& attribute) {
  if (const float* value = std::get_if<float>(&attribute.value)) return *value;
  const std::string* text = std::get_if<std::string>(&attribute.value);
  const auto number = text ? parse_number(*text) : std::nullopt;
  // Another program's text may say anything; --fps has the same limits.
  if (!number || *number < 0.1 || *number > 1000) return std::nullopt;
  return static_cast<float>(*number);
}

Result<Frames> from_images(const StripOptions& options) {
  PM_TRY(const FramePattern pattern, parse_pattern(options.input));
  if (!pattern.has_number())
    return make_error(ErrorCode::kUsage, "{}: is one image - name a sequence with #### or a scene",
                      options.input);
  Frames frames;
  PM_TRY(const std::vector<int> existing, existing_frames(pattern));
  if (existing.empty()) return make_error(ErrorCode::kInput, "{}: no such frames", options.input);
  frames.first = existing.front();
  frames.last = existing.back();
  PM_TRY(frames.numbers,
         parse_frames(options.frames.empty() ? fmt::format("{}-{}", frames.first, frames.last)
                                             : options.frames,
                      frames.first, frames.last));
  // A sheet or movie that silently leaves out a lost frame is worse than none.
  std::vector<int> wanted = frames.numbers;
  if (options.frames.empty() || options.moves()) {
    wanted.clear();
    for (int frame = frames.first; frame <= frames.last; ++frame) wanted.push_back(frame);
  }
  for (const int frame : wanted)
    if (!std::binary_search(existing.begin(), existing.end(), frame))
      return make_error(ErrorCode::kInput,
                        "{}: frame {} is missing (there are {} to {}) - render it first",
                        options.input, frame, frames.first, frames.last);
  if (!options.moves() && options.frames.empty())
    frames.numbers = spread(frames.numbers, options.count);
  for (const int number : frames.numbers) {
    remember_input(frame_path(pattern, number));
    PM_TRY(Image image, read_image(frame_path(pattern, number)));
    float exposure = 0;
    for (const Attribute& attribute : image.attributes) {
      const float* value = std::get_if<float>(&attribute.value);  // of an EXR; a PNG's are texts
      if (attribute.name == "FramesPerSecond") frames.fps = fps_of(attribute).value_or(frames.fps);
      if (value && attribute.name == "polymorph/exposure") exposure = *value;
    }
    expose(image, exposure);
    frames.images.push_back(slim(image, options.width));
  }
  return frames;
}

std::string label_of(const StripOptions& options, const Frames& frames, int number) {
  if (options.label == "none") return "";
  if (options.label == "frame") return fmt::format("frame {}", number);
  const int span = std::max(1, frames.last - frames.first);
  return fmt::format("t = {:.2f}", static_cast<double>(number - frames.first) / span);
}

Status write_sheet(const StripOptions& options, const Frames& frames) {
  const std::vector<int> chosen =
      options.frames.empty() ? spread(frames.numbers, options.count) : frames.numbers;
  std::vector<Image> cells;
  std::vector<std::string> labels;
  for (const int number : chosen) {
    const auto at =
        std::find(frames.numbers.begin(), frames.numbers.end(), number) - frames.numbers.begin();
    cells.push_back(frames.images[static_cast<std::size_t>(at)]);
    labels.push_back(label_of(options, frames, number));
  }
  StripSettings settings;
  settings.columns = options.columns;
  settings.cell_width = options.width;
  settings.labels = options.label != "none";
  PM_TRY(const Image sheet, make_strip(cells, labels, settings));
  PngSettings png;
  png.effort = PngEffort::kSmall;  // sheets go into pages and papers
  PM_TRY_STATUS(write_image(options.output, sheet, png));
  print_data("{}\n", options.output);
  return Ok{};
}

/// Before any work.
Status check_outputs(const StripOptions& options, bool overwrite) {
  if (options.output.empty() && !options.moves())
    return make_error(ErrorCode::kUsage,
                      "nothing to make - give -o strip.png, --gif morph.gif or --mp4 morph.mp4");
  const std::string extension = std::filesystem::path(options.output).extension().string();
  if (!options.output.empty() && extension != ".png" && extension != ".exr")
    return make_error(ErrorCode::kUsage, "{}: unknown image format \"{}\" - use .png or .exr",
                      options.output, extension);
  if (!options.mp4.empty() && find_ffmpeg().empty())
    return make_error(ErrorCode::kResource,
                      "--mp4 needs ffmpeg, which is not installed - install it, or render PNGs and "
                      "run elsewhere: ffmpeg -framerate 24 -i frame.%04d.png -c:v libx264 -crf 18 "
                      "-pix_fmt yuv420p {}",
                      options.mp4);
  for (const std::string& file : {options.output, options.gif, options.mp4}) {
    if (file.empty()) continue;
    PM_TRY_STATUS(check_output(file, overwrite));
  }
  return Ok{};
}

Result<int> run_strip(const CommandLine& line, const StripOptions& options) {
  PM_TRY_STATUS(check_outputs(options, line.common.overwrite));
  const bool is_scene = std::filesystem::path(options.input).extension() == ".json";
  auto made = is_scene ? from_scene(line, options) : from_images(options);
  if (!made) return std::move(made).error();
  Frames& frames = *made;
  if (!options.output.empty()) PM_TRY_STATUS(write_sheet(options, frames));
  if (!options.gif.empty()) {
    PM_TRY(const std::string gif,
           encode_gif(frames.images, options.fps > 0 ? options.fps : frames.fps));
    PM_TRY_STATUS(write_file(options.gif, gif));
    print_data("{}\n", options.gif);
  }
  if (!options.mp4.empty()) {
    PM_TRY_STATUS(
        write_mp4(options.mp4, frames.images, options.fps > 0 ? options.fps : frames.fps));
    print_data("{}\n", options.mp4);
  }
  return 0;
}

}  // namespace

void add_strip(CommandLine& line) {
  auto options = std::make_shared<StripOptions>();
  CLI::App* command = add_command(
      line, "strip", "Make a contact sheet, a GIF or a movie of a sequence.",
      "  polymorph strip out/frame.####.exr -n 8 -o strip.png\n"
      "  polymorph strip scene.json -n 6 --columns 3 --label t -o strip.png\n"
      "  polymorph strip out/frame.####.png --gif morph.gif --mp4 morph.mp4",
      "  0 made   2 usage   3 bad scene, unreadable or missing frames   4 cannot write\n"
      "  5 device or memory   130, 143 stopped by a signal");
  command->add_option("input", options->input, "a scene file, or existing frames with ####")
      ->required()
      ->type_name("SCENE|FRAMES")
      ->group("Main");
  command->add_option("-o,--output", options->output, "the sheet: .png or .exr")
      ->type_name("FILE")
      ->group("Main");
  command->add_option("-n,--count", options->count, "cells, evenly spread over the sequence (8)")
      ->transform(number_from(1, 1000))
      ->type_name("N")
      ->group("Main");
  command->add_option("-f,--frames", options->frames, "these frames instead")
      ->type_name("LIST")
      ->group("Main");
  command->add_option("--columns", options->columns, "cells a row (4)")
      ->transform(number_from(1, 1000))
      ->type_name("N")
      ->group("Main");
  command
      ->add_option("--width", options->width,
                   "width of a cell, GIF and movie; default: as rendered")
      ->transform(number_from(16, 32768))
      ->type_name("PIXELS")
      ->group("Main");
  command->add_option("--label", options->label, "frame, t or none")
      ->check(CLI::IsMember({"frame", "t", "none"}))
      ->type_name("WHAT")
      ->group("Main");
  command->add_option("--gif", options->gif, "an animated GIF of all frames")
      ->type_name("FILE")
      ->group("Main");
  command->add_option("--mp4", options->mp4, "a movie of all frames, by ffmpeg")
      ->type_name("FILE")
      ->group("Main");
  command->add_option("--fps", options->fps, "of GIF and movie; default: the scene's")
      ->transform(number_from(0.1, 100.0))
      ->type_name("F")
      ->group("Main");
  add_overwrite(command, line.common)->group("Main");
  add_overrides(command, options->sets);
  command->callback(
      [&line, options] { line.action = [&line, options] { return run_strip(line, *options); }; });
}

}  // namespace polymorph
