#include "export/film_pictures.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/exact_math.h"
#include "base/file.h"
#include "base/log.h"
#include "base/stop.h"
#include "base/stopwatch.h"
#include "base/worker.h"
#include "device/device.h"
#include "image/image_io.h"
#include "image/rgb_channels.h"
#include "image/strip.h"
#include "morph/timeline.h"
#include "sequence/frame/frame_geometry.h"
#include "sequence/frame/paint_origins.h"
#include "sequence/frame/render_frame.h"

namespace polymorph {
namespace {

/// Formats the label of a cell; `kind` is SheetSettings::label.
std::string format_label(const std::string& kind, const Film& film, int number) {
  if (kind == "none") return "";
  if (kind == "frame") return fmt::format("frame {}", number);
  const int span = std::max(1, film.last - film.first);
  return fmt::format("t = {:.2f}", static_cast<double>(number - film.first) / span);
}

}  // namespace

std::vector<int> choose_evenly(const std::vector<int>& numbers, int n) {
  if (n >= static_cast<int>(numbers.size())) return numbers;
  std::vector<int> chosen;
  for (int i = 0; i < n; ++i) {
    const double index =
        n == 1 ? 0.5 * static_cast<double>(numbers.size() - 1)
               : static_cast<double>(i) * static_cast<double>(numbers.size() - 1) / (n - 1);
    chosen.push_back(numbers[static_cast<std::size_t>(std::lround(index))]);
  }
  return chosen;
}

std::vector<int> choose_by_change(const Film& film, int n) {
  std::vector<double> change_until{0};  // sum of the differences from the first image to each
  for (std::size_t i = 1; i < film.images.size(); ++i) {
    const std::vector<float>&a = film.images[i - 1].pixels, &b = film.images[i].pixels;
    double change = 0;
    for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k)
      change += std::abs(static_cast<double>(b[k]) - static_cast<double>(a[k]));
    change_until.push_back(change_until.back() + change);
  }
  if (n < 2 || change_until.back() == 0) return choose_evenly(film.numbers, n);
  std::vector<int> chosen;
  for (int i = 0; i < n; ++i) {
    const double target = change_until.back() * i / (n - 1);  // may round up beyond the last value
    auto nearest = std::lower_bound(change_until.begin(), change_until.end() - 1, target);
    if (nearest != change_until.begin() && target - *(nearest - 1) < *nearest - target)
      nearest = std::lower_bound(change_until.begin(), change_until.end(),
                                 *(nearest - 1));  // the first of equal images
    const int number = film.numbers[static_cast<std::size_t>(nearest - change_until.begin())];
    if (chosen.empty() || number != chosen.back()) chosen.push_back(number);
  }
  chosen.back() = film.numbers.back();  // the last of equal images, not the first
  return chosen;
}

void expose(Image& image, float stops) {
  if (stops == 0) return;
  const float factor = static_cast<float>(exact::exp2(static_cast<double>(stops)));
  for (const int channel : find_rgb(image))  // -1: the image has no such channel
    for (std::size_t i = static_cast<std::size_t>(std::max(channel, 0));
         channel >= 0 && i < image.pixels.size(); i += image.channel_count())
      image.pixels[i] *= factor;
}

Image resized_colors(const Image& image, int width) {
  std::vector<std::string> names;
  for (const char* name : {"R", "G", "B", "A"})
    if (image.find_channel(name) >= 0) names.emplace_back(name);
  Image colors = make_image(image.width, image.height, names);
  for (std::size_t c = 0; c < names.size(); ++c) {
    // Pixels are interleaved: i runs over the values of channel c, k over those of channel `from`.
    const auto from = static_cast<std::size_t>(image.find_channel(names[c]));
    for (std::size_t i = c, k = from; i < colors.pixels.size();
         i += names.size(), k += image.channel_count())
      colors.pixels[i] = image.pixels[k];
  }
  if (width == 0 || names.empty()) return colors;
  return resize_image(colors, width, std::max(1, width * image.height / image.width));
}

Result<EngineScene> prepare_film(Scene scene, const Resources& resources) {
  scene.image.aovs = "none";  // PNGs, sheets and GIFs have no layers for AOVs
  // Two pictures are in memory at once: the one that is traced, and a copy of its colours.
  PM_TRY_STATUS(check_picture_memory(scene.image, 2, resources.max_memory));
  return prepare_on_engine(scene, resources, /*pictures=*/2);
}

Status check_has_plans(const PreparedScene& prepared) {
  for (const PreparedActor& actor : prepared.actors)
    if (actor.sequence)
      return make_error(ErrorCode::kInput,
                        "{}: is a mesh sequence - plans are of morphs between two objects",
                        actor.name);
  return Ok{};
}

Result<Film> render_film(const EngineScene& film_scene, std::vector<int> numbers,
                         const FilmSettings& settings) {
  const PreparedScene& prepared = film_scene.prepared;
  Film film;
  film.last = frame_count(prepared.scene);
  film.fps = prepared.scene.frames.fps;
  if (settings.content == FilmContent::kPlan) PM_TRY_STATUS(check_has_plans(film_scene.prepared));
  PM_TRY(Renderer renderer, make_renderer(film_scene.device, film_scene.max_memory));
  // A worker traces a frame while this thread makes the surface of the next one.
  struct Traced {
    Result<Image> image;
    double seconds = 0;
  };
  std::string traced_key;  // picture_key() of the frame that is traced
  int equal_frames = 0;    // number of successive frames with this key, which are not added yet
  std::future<Traced> tracing;
  // Waits for the frame that is traced, and adds its image to the film, once per equal frame.
  const auto add_traced_frames = [&]() -> Status {
    if (!tracing.valid()) return Ok{};
    Traced traced = tracing.get();
    PM_TRY(Image image, std::move(traced.image));
    const int traced_number = numbers[film.images.size()];
    expose(image, scene_at(prepared.scene, static_cast<double>(traced_number)).image.exposure);
    const Image colors = resized_colors(image, settings.width);
    for (; equal_frames > 0; --equal_frames) {
      FrameRecord record;
      record.frame = numbers[film.images.size()];
      record.state = FrameRecord::State::kDone;
      record.seconds = record.frame == traced_number ? traced.seconds : 0;
      film.images.push_back(colors);
      if (settings.progress) settings.progress(film.images.size(), numbers.size(), record);
    }
    return Ok{};
  };
  Worker worker;  // declared last: its task refers to the variables above
  for (const int number : numbers) {
    if (stop_requested()) return make_error(stop_code(), "stopped - nothing was written");
    std::string key = picture_key(prepared, number);
    if (!key.empty() && equal_frames > 0 && key == traced_key) {
      ++equal_frames;
      continue;
    }
    const Stopwatch stopwatch;
    PM_TRY(FrameGeometry geometry, geometry_at(prepared, *film_scene.engine, number));
    if (settings.content == FilmContent::kPlan)
      PM_TRY_STATUS(paint_origins(prepared, *film_scene.engine, geometry));
    const double surface_seconds = stopwatch.seconds();
    PM_TRY_STATUS(add_traced_frames());
    traced_key = std::move(key);
    equal_frames = 1;
    tracing = worker.run([&, surface_seconds, geometry = std::move(geometry)]() -> Traced {
      const Stopwatch tracing_time;
      auto image = render_frame(prepared, geometry, renderer, film_scene.device, "");
      return {std::move(image), surface_seconds + tracing_time.seconds()};
    });
  }
  PM_TRY_STATUS(add_traced_frames());
  film.numbers = std::move(numbers);
  return film;
}

Status check_sheet(const std::filesystem::path& path, bool overwrite) {
  const std::string extension = path.extension().string();
  if (extension != ".png" && extension != ".exr")
    return make_error(ErrorCode::kUsage, "{}: unknown image format \"{}\" - use .png or .exr",
                      path.string(), extension);
  return check_output(path, overwrite);
}

Status write_sheet(const std::filesystem::path& path, const Film& film,
                   const SheetSettings& settings) {
  const std::vector<int> chosen = settings.all ? film.numbers
                                  : settings.by_change
                                      ? choose_by_change(film, settings.count)
                                      : choose_evenly(film.numbers, settings.count);
  std::vector<Image> cells;
  std::vector<std::string> labels;
  for (const int number : chosen) {
    const auto index =
        std::find(film.numbers.begin(), film.numbers.end(), number) - film.numbers.begin();
    cells.push_back(film.images[static_cast<std::size_t>(index)]);
    labels.push_back(format_label(settings.label, film, number));
  }
  StripSettings strip;
  strip.columns = settings.columns;
  strip.cell_width = settings.cell_width;
  strip.labels = settings.label != "none";
  PM_TRY(const Image sheet, make_strip(cells, labels, strip));
  PngSettings png;
  png.effort = PngEffort::kSmall;  // sheets are embedded in web pages and papers
  return write_image(path, sheet, png);
}

Status write_gif(const std::filesystem::path& path, const Film& film, float fps) {
  PM_TRY(const std::string gif, encode_gif(film.images, fps > 0 ? fps : film.fps));
  return write_file(path, gif);
}

}  // namespace polymorph
