#include <algorithm>

#include "base/file.h"
#include "base/frames.h"
#include "cli/command_line.h"
#include "cli/progress.h"
#include "cli/scene_options.h"
#include "cli/write_play_page.h"
#include "export/film_pictures.h"
#include "image/display_view.h"
#include "image/extract_matte.h"
#include "image/image_io.h"
#include "image/movie.h"
#include "model/load/load_model.h"
#include "morph/timeline.h"

namespace polymorph {
namespace {

struct StripOptions {
  std::string input, output, gif, mp4, html, label = "frame", by = "time", show = "scene", frames,
                                             matte;
  int count = 8, columns = 4;  ///< cells of the sheet; cells per row
  int width = 0;               ///< pixels of a cell; 0: as rendered
  bool is_animated() const { return !gif.empty() || !mp4.empty(); }
  bool by_change() const { return by == "change"; }
  FilmContent content() const { return show == "plan" ? FilmContent::kPlan : FilmContent::kScene; }
  float fps = 0;  ///< 0: the scene's
  SceneOptions scene_options;
};

/// Chooses frames of a scene by how much the picture changes (choose_by_change()). Renders all
/// frames with one sample per pixel and scales them to 96 pixels.
Result<std::vector<int>> choose_frames_by_change(const CommandLine& line, Scene scene,
                                                 const std::vector<int>& numbers,
                                                 const StripOptions& options) {
  constexpr int kWidth = 96;  // pixels
  scene.image.samples = 1;
  PM_TRY(const EngineScene film_scene, prepare_film(std::move(scene), resources(line.common)));
  PM_TRY(const Film film,
         render_film(film_scene, numbers,
                     {.width = kWidth, .progress = make_progress(progress_mode(line.common))}));
  return choose_by_change(film, options.count);
}

/// Opens the view of --display and --view, if they are given. Errors: kUsage for an EXR.
Result<std::optional<ViewTransform>> open_view(const StripOptions& options) {
  const DisplayView& view = options.scene_options.view;
  std::optional<ViewTransform> transform;
  if (view.empty() || options.content() == FilmContent::kPlan) return transform;
  if (std::filesystem::path(options.output).extension() == ".exr")
    return make_error(ErrorCode::kUsage,
                      "{}: an EXR has no view - name a .png, or leave out --display and --view",
                      options.output);
  PM_TRY(transform, ViewTransform::open(view));
  return transform;
}

/// Applies the view, if there is one, to all pictures.
Status apply_view(const std::optional<ViewTransform>& view, Film& film) {
  for (Image& image : film.images)
    if (view) PM_TRY_STATUS(view->apply(image));
  return Ok{};
}

/// Renders the frames that the options choose.
Result<Film> film_from_scene(const CommandLine& line, const StripOptions& options) {
  PM_TRY(Scene scene, load_scene_with(options.input, options.scene_options));
  PM_TRY(const std::optional<ViewTransform> view, open_view(options));
  const int count = frame_count(scene);
  PM_TRY(std::vector<int> numbers, parse_frames_or_all(options.frames, 1, count));
  if (!options.is_animated() && options.frames.empty()) {
    if (options.by_change()) {
      PM_TRY(numbers, choose_frames_by_change(line, scene, numbers, options));
    } else {
      numbers = choose_evenly(numbers, options.count);
    }
  }
  PM_TRY(const EngineScene film_scene, prepare_film(std::move(scene), resources(line.common)));
  PM_TRY(Film film, render_film(film_scene, std::move(numbers),
                                {options.width, options.content(),
                                 make_progress(progress_mode(line.common))}));
  PM_TRY_STATUS(apply_view(view, film));
  return film;
}

/// Parses the frame rate in a header: a number in EXR files, a text in PNG files. Returns nullopt
/// for a text that is no number in [0.1, 1000], the range of frames.fps.
std::optional<float> parse_fps(const Attribute& attribute) {
  if (const float* value = std::get_if<float>(&attribute.value)) return *value;
  const std::string* text = std::get_if<std::string>(&attribute.value);
  const auto number = text ? parse_number(*text) : std::nullopt;
  if (!number || *number < 0.1 || *number > 1000) return std::nullopt;
  return static_cast<float>(*number);
}

/// Reads a frame, or, with --matte, the frame's matte of that name.
Result<Image> read_frame(const StripOptions& options, const std::filesystem::path& file) {
  remember_input(file);
  PM_TRY(Image image, read_image(file));
  if (options.matte.empty()) return image;
  PM_TRY(Image matte, extract_matte(image, options.matte, file.string()));
  std::erase_if(image.attributes,
                [](const Attribute& attribute) { return attribute.name != "FramesPerSecond"; });
  matte.attributes = std::move(image.attributes);
  return matte;
}

/// Reads the existing frames that the options choose, with their exposure and the view applied.
Result<Film> film_from_images(const StripOptions& options) {
  PM_TRY(const FramePattern pattern, parse_pattern(options.input));
  if (!pattern.has_number())
    return make_error(ErrorCode::kUsage, "{}: is one image - name a sequence with #### or a scene",
                      options.input);
  PM_TRY(const std::optional<ViewTransform> view, open_view(options));
  // Choose the frames.
  Film film;
  PM_TRY(const std::vector<int> existing, existing_frames(pattern));
  if (existing.empty()) return make_error(ErrorCode::kInput, "{}: no such frames", options.input);
  film.first = existing.front();
  film.last = existing.back();
  PM_TRY(film.numbers, parse_frames_or_all(options.frames, film.first, film.last));
  // Missing frames are errors: a sheet or movie without them would look complete.
  std::vector<int> required = film.numbers;
  if (options.frames.empty() || options.is_animated()) {
    required.clear();
    for (int frame = film.first; frame <= film.last; ++frame) required.push_back(frame);
  }
  for (const int frame : required)
    if (!std::binary_search(existing.begin(), existing.end(), frame))
      return make_error(ErrorCode::kInput,
                        "{}: frame {} is missing (there are {} to {}) - render it first",
                        options.input, frame, film.first, film.last);
  if (!options.is_animated() && options.frames.empty() && !options.by_change())
    film.numbers = choose_evenly(film.numbers, options.count);
  // Read the frames, and from their headers the exposure and the frame rate.
  for (const int number : film.numbers) {
    PM_TRY(Image image, read_frame(options, frame_path(pattern, number)));
    float exposure = 0;
    for (const Attribute& attribute : image.attributes) {
      if (view && attribute.name == kViewAttribute)
        return make_error(ErrorCode::kUsage,
                          "{}: is a picture by a view already - leave out --display and --view",
                          frame_path(pattern, number).string());
      const float* value =
          std::get_if<float>(&attribute.value);  // null for a PNG, whose attributes are texts
      if (attribute.name == "FramesPerSecond") film.fps = parse_fps(attribute).value_or(film.fps);
      if (value && attribute.name == "polymorph/exposure") exposure = *value;
    }
    expose(image, exposure);
    film.images.push_back(resized_colors(image, options.width));
  }
  PM_TRY_STATUS(apply_view(view, film));
  return film;
}

/// Checks the output options before any work: at least one is given, and their files may be
/// written.
Status check_outputs(const StripOptions& options, bool overwrite) {
  if (options.output.empty() && !options.is_animated() && options.html.empty())
    return make_error(ErrorCode::kUsage,
                      "nothing to make - give -o strip.png, --gif morph.gif, --mp4 morph.mp4 or "
                      "--html play.html");
  if (!options.output.empty()) PM_TRY_STATUS(check_sheet(options.output, overwrite));
  if (!options.mp4.empty() && find_ffmpeg().empty())
    return make_error(ErrorCode::kResource,
                      "--mp4 needs ffmpeg, which is not installed - install it, or render PNGs and "
                      "run elsewhere: ffmpeg -framerate 24 -i frame.%04d.png -c:v libx264 -crf 18 "
                      "-pix_fmt yuv420p {}",
                      quote_for_shell(options.mp4));
  for (const std::string& file : {options.gif, options.mp4}) {
    if (file.empty()) continue;
    PM_TRY_STATUS(check_output(file, overwrite));
  }
  return Ok{};
}

/// Writes the matte of one image, or one matte per image of a sequence.
Result<int> write_mattes(const StripOptions& options, bool overwrite) {
  if (options.output.empty() || options.is_animated())
    return make_error(ErrorCode::kUsage, "--matte of one image needs -o matte.png alone");
  PM_TRY(const FramePattern input, parse_pattern(options.input));
  PM_TRY(const FramePattern output, parse_pattern(options.output));
  std::vector<int> numbers{0};  // one image, whose names have no number
  if (output.has_number()) {
    if (!input.has_number())
      return make_error(ErrorCode::kUsage, "{}: is one image - give -o a name without ####",
                        options.input);
    PM_TRY(numbers, existing_frames(input));
    if (numbers.empty()) return make_error(ErrorCode::kInput, "{}: no such frames", options.input);
    if (!options.frames.empty()) {
      PM_TRY(numbers, parse_frames(options.frames, numbers.front(), numbers.back()));
    }
  }
  for (const int number : numbers) remember_input(frame_path(input, number));
  for (const int number : numbers)
    PM_TRY_STATUS(check_sheet(frame_path(output, number), overwrite));
  for (const int number : numbers) {
    PM_TRY(const Image matte, read_frame(options, frame_path(input, number)));
    const std::filesystem::path file = frame_path(output, number);
    PM_TRY_STATUS(write_image(file, matte));
    print_data("{}\n", file.string());
  }
  return 0;
}

/// Tests whether each matte is a file of its own, rather than a cell of a sheet.
Result<bool> are_mattes_single(const StripOptions& options) {
  if (options.matte.empty()) return false;
  PM_TRY(const FramePattern input, parse_pattern(options.input));
  PM_TRY(const FramePattern output,  // without -o, any name that has no number
         parse_pattern(options.output.empty() ? "matte.png" : options.output));
  return !input.has_number() || output.has_number();
}

/// Makes the mattes alone, or the page, the sheet, the GIF and the movie that the options name.
Result<int> run_strip(const CommandLine& line, const StripOptions& options) {
  // A model is treated as a scene, because load_scene() has a helpful error for models.
  const bool is_scene =
      std::filesystem::path(options.input).extension() == ".json" || is_model_file(options.input);
  if (!options.matte.empty() && is_scene)
    return make_error(ErrorCode::kUsage, "--matte needs frames with Cryptomattes, not {}",
                      options.input);
  if (!options.matte.empty() && !options.scene_options.view.empty())
    return make_error(ErrorCode::kUsage, "a matte has no view - leave out --display and --view");
  PM_TRY(const bool writes_single_mattes, are_mattes_single(options));
  if (writes_single_mattes) return write_mattes(options, line.common.overwrite);
  PM_TRY_STATUS(check_outputs(options, line.common.overwrite));
  if (options.content() == FilmContent::kPlan && (!is_scene || !options.html.empty()))
    return make_error(ErrorCode::kUsage,
                      "--show plan is for the sheet, GIF and movie of a scene, not for {}",
                      is_scene ? "--html" : options.input);
  if (!options.html.empty()) {
    if (!is_scene)
      return make_error(ErrorCode::kUsage, "--html needs a scene, not frames: {}", options.input);
    PM_TRY_STATUS(check_play_page(line, options.html));
    PM_TRY(Scene scene, load_scene_with(options.input, options.scene_options));
    PM_TRY_STATUS(write_play_page(line, std::move(scene), options.html));
    if (options.output.empty() && !options.is_animated()) return 0;
  }
  auto film_or_error = is_scene ? film_from_scene(line, options) : film_from_images(options);
  if (!film_or_error) return std::move(film_or_error).error();
  const Film& film = *film_or_error;
  if (!options.output.empty()) {
    SheetSettings sheet;
    sheet.count = options.count;
    const bool is_chosen_by_change = is_scene && options.by_change() && !options.is_animated();
    sheet.all = !options.frames.empty() || is_chosen_by_change;  // the film has no other frames
    sheet.by_change = options.by_change();
    sheet.columns = options.columns;
    sheet.cell_width = options.width;
    sheet.label = options.label;
    PM_TRY_STATUS(write_sheet(options.output, film, sheet));
    print_data("{}\n", options.output);
  }
  if (!options.gif.empty()) {
    PM_TRY_STATUS(write_gif(options.gif, film, options.fps));
    print_data("{}\n", options.gif);
  }
  if (!options.mp4.empty()) {
    PM_TRY_STATUS(write_mp4(options.mp4, film.images, options.fps > 0 ? options.fps : film.fps));
    print_data("{}\n", options.mp4);
  }
  return 0;
}

}  // namespace

void add_strip(CommandLine& line) {
  auto options = std::make_shared<StripOptions>();
  Command command = add_command(
      line, "strip", "Make a contact sheet, a GIF or a movie of a sequence.",
      "  polymorph strip 'out/frame.####.exr' -c 8 -o strip.png\n"
      "  polymorph strip scene.json -c 6 --columns 3 --label t -o strip.png\n"
      "  polymorph strip scene.json -c 6 --show plan -o plan.png\n"
      "  polymorph strip 'out/frame.####.png' --gif morph.gif --mp4 morph.mp4\n"
      "  polymorph strip out/frame.0012.exr --matte teapot -o matte.png",
      "  0 made   2 usage   3 bad scene, unreadable or missing frames   4 cannot write\n"
      "  5 device or memory   130, 143 stopped by a signal");
  command
      .add_option("input", options->input, "SCENE|FRAMES",
                  "a scene file, or existing frames with ####")
      .required();
  command.add_option("-o,--output", options->output, "FILE", "the sheet: .png or .exr");
  command
      .add_option("-c,--count", options->count, "N", "cells, evenly spread over the sequence (8)")
      .range(1, 1000);
  command
      .add_option("--by", options->by, "WHAT",
                  "spread the cells by time, or by how much the picture changes (time)")
      .choices({"time", "change"});
  command
      .add_option("--show", options->show, "WHAT",
                  "scene, or plan: what becomes what; each point has the colour of the place that "
                  "it comes from (scene)")
      .choices({"scene", "plan"});
  command.add_option(
      "--matte", options->matte, "NAME",
      "the coverage of this name in the frames' Cryptomattes, in grey, instead of their "
      "colours; of one image, or with #### in -o, each as a picture of its own");
  command.add_option("-f,--frames", options->frames, "LIST", "these frames instead");
  command.add_option("--columns", options->columns, "N", "cells per row (4)").range(1, 1000);
  command
      .add_option("--width", options->width, "PIXELS",
                  "width of a cell, GIF and movie; default: as rendered")
      .range(16, 32768);
  command.add_option("--label", options->label, "WHAT", "frame, t or none")
      .choices({"frame", "t", "none"});
  command.add_option("--gif", options->gif, "FILE", "an animated GIF of all frames");
  command.add_option("--mp4", options->mp4, "FILE", "a movie of all frames, by ffmpeg");
  command.add_option("--html", options->html, "FILE", "page that plays a scene in a browser");
  command
      .add_option("--fps", options->fps, "F",
                  "frames per second of GIF and movie; default: the scene's")
      .range(0.1, 100.0);
  add_overwrite(command, line.common);
  add_scene_options(command, options->scene_options);
  set_action(line, command, [&line, options] { return run_strip(line, *options); });
}

}  // namespace polymorph
