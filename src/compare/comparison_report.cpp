#include "compare/comparison_report.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "base/file.h"
#include "base/html_page.h"
#include "base/text.h"
#include "compare/pictures.h"
#include "compare/report_data.h"
#include "image/image_io.h"
#include "image/strip.h"
#include "scene/json_text.h"

namespace polymorph {

extern const std::string_view report_page;  // report.html

namespace {

namespace fs = std::filesystem;

constexpr int kThumbnailWidth = 168;  // twice what the list shows
constexpr int kWidest = 2048;

Image narrowed(const Image& image, int width) {
  if (image.width <= width) return image;
  const auto height = static_cast<int>(std::int64_t{image.height} * width / image.width);
  return resize_image(image, width, std::max(1, height));
}

Status encode_into(std::string& png, const Image& image, int width, PictureBudget& budget) {
  PM_TRY(png, encode_png(narrowed(image, width)));
  budget.used += png.size();
  return Ok{};
}

bool same_size(const Image& a, const Image& b) {
  return a.width == b.width && a.height == b.height;
}

/// Swiping and flipping need two pictures of one size: the smaller one is shown in a corner of the
/// common canvas.
Image on_canvas(const Image& image, int width, int height) {
  Image canvas = make_image(width, height, {"R", "G", "B"});
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < 3; ++c) canvas.at(x, y, c) = image.at(x, y, c);
  return canvas;
}

std::string file_name(const ReportCase& one) {
  // "new.0001.exr" and "frame 12" alike: the name, a place for what must not stand in one, ".png".
  std::string name = std::filesystem::path(one.name).replace_extension().string();
  if (!one.group.empty()) name = one.group + "." + name;
  for (char& c : name)
    if (c == ' ')
      c = '.';
    else if (c == '/' || c == '\\')
      c = '_';
  return name + ".png";
}

nlohmann::ordered_json page_case(const ReportCase& one) {
  auto json = case_json(one);
  json["width"] = one.width;
  json["height"] = one.height;
  json["shown_width"] = std::min(one.width, kWidest);
  json["shown_height"] =
      one.width > kWidest
          ? std::max(1, static_cast<int>(std::int64_t{one.height} * kWidest / one.width))
          : one.height;
  if (one.comparison && one.comparison->flip)
    json["heat_range"] = heat_range(one.comparison->flip->max);
  json["pictures"] = nlohmann::ordered_json::object();
  const std::pair<const char*, const std::string*> pictures[] = {{"reference", &one.reference_png},
                                                                 {"actual", &one.actual_png},
                                                                 {"heat", &one.heat_png},
                                                                 {"limits", &one.limits_png},
                                                                 {"thumbnail", &one.thumbnail_png}};
  for (const auto& [name, png] : pictures)
    if (!png->empty()) json["pictures"][name] = base64(*png);
  if (one.actual_png.empty() && !one.thumbnail_png.empty())
    json["pictures_note"] = "Left out, to keep the page small: compare the files named below.";
  return json;
}

/// What a report.json says its report consists of; nothing if it is not one of ours.
std::vector<std::string> listed_files(const fs::path& report_json) {
  const auto text = read_file(report_json, 256 << 20);
  if (!text) return {};
  const auto shallow = [](int depth, nlohmann::json::parse_event_t, nlohmann::json&) {
    return depth < 16;
  };
  const auto json = nlohmann::json::parse(*text, shallow, false);
  if (!json.is_object() || !json.contains("polymorph_report")) return {};
  std::vector<std::string> names;
  for (const auto& entry : json["polymorph_report"]) {
    if (!entry.is_string()) continue;
    const auto name = entry.get<std::string>();
    // A name in this folder, never a path out of it.
    if (!name.empty() && name[0] != '.' && fs::path(name).filename() == name) names.push_back(name);
  }
  return names;
}

}  // namespace

std::size_t Report::failed() const {
  return static_cast<std::size_t>(
      std::count_if(cases.begin(), cases.end(), [](const ReportCase& c) { return !c.passed(); }));
}

std::size_t Report::errors() const {
  return static_cast<std::size_t>(
      std::count_if(cases.begin(), cases.end(), [](const ReportCase& c) { return c.error; }));
}

Status add_pictures(ReportCase& one, const Image& actual, const Image* reference,
                    const PixelMaps& maps, PictureBudget& budget) {
  one.width = std::max(actual.width, reference ? reference->width : 0);
  one.height = std::max(actual.height, reference ? reference->height : 0);
  if (one.width < 1 || one.height < 1) return Ok{};
  Image shown = on_canvas(visible_colors(actual), one.width, one.height);
  const bool whole = budget.used < (one.passed() ? budget.passing : budget.failing);
  if (!whole || one.width > 2 * kThumbnailWidth)
    PM_TRY_STATUS(encode_into(one.thumbnail_png, shown, kThumbnailWidth, budget));
  if (!one.passed() && reference) {
    PM_TRY(const Image triptych, one.comparison
                                     ? failure_picture(actual, *reference, *one.comparison, maps)
                                     : Result<Image>(difference_triptych(actual, *reference)));
    PM_TRY(one.triptych_png, encode_png(triptych, {.effort = PngEffort::kSmall}));
  } else if (!one.passed()) {
    PM_TRY(one.triptych_png, encode_png(shown, {.effort = PngEffort::kSmall}));
  }
  if (!whole) return Ok{};
  PM_TRY_STATUS(encode_into(one.actual_png, shown, kWidest, budget));
  if (!reference) return Ok{};
  PM_TRY_STATUS(encode_into(one.reference_png,
                            on_canvas(visible_colors(*reference), one.width, one.height), kWidest,
                            budget));
  if (!same_size(actual, *reference) || maps.states.empty()) return Ok{};
  if (!maps.flip.empty()) {
    const double range = heat_range(one.comparison->flip->max);
    PM_TRY_STATUS(encode_into(one.heat_png, heat_picture(maps.flip, one.width, one.height, range),
                              kWidest, budget));
  }
  const bool over = std::any_of(maps.states.begin(), maps.states.end(),
                                [](PixelState s) { return s >= PixelState::kOver; });
  if (over)
    PM_TRY_STATUS(
        encode_into(one.limits_png, limits_picture(*reference, maps.states), kWidest, budget));
  return Ok{};
}

std::string page_of(const std::string& title, nlohmann::ordered_json data) {
  // What failed first, the worst first; then warnings, then what is good, in its order.
  const auto rank = [](const nlohmann::ordered_json& c) {
    if (c.value("passed", false)) return std::pair(c.value("warned", false) ? 1 : 2, 0.0);
    double visible = c.contains("flip") ? c["flip"].value("mean", 0.0) : 1e9;
    return std::pair(0, -visible);
  };
  std::stable_sort(data["cases"].begin(), data["cases"].end(),
                   [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
  return fill_page(report_page, {{"{{title}}", escape_markup(title)},
                                 {"{{data}}", json_in_script(dump_json(data, -1))}});
}

std::string report_html(const Report& report) {
  nlohmann::ordered_json data{{"title", report.title}, {"facts", report.facts}};
  data["notes"] = report.notes;
  data["cases"] = nlohmann::ordered_json::array();
  for (const ReportCase& one : report.cases) data["cases"].push_back(page_case(one));
  return page_of(report.title, std::move(data));
}

Status remove_report(const fs::path& folder) {
  const fs::path list = folder / "report.json";
  std::error_code error;
  if (!fs::is_regular_file(fs::symlink_status(list, error))) return Ok{};
  for (const std::string& name : listed_files(list)) {
    // The list goes last: who is stopped before that can go on from it.
    if (name == "report.json" || !fs::is_regular_file(fs::symlink_status(folder / name, error)))
      continue;
    if (!fs::remove(folder / name, error) && error)
      return make_error(ErrorCode::kOutput, "{}: cannot remove an earlier report's file: {}",
                        (folder / name).string(), error.message());
  }
  if (!listed_files(list).empty() && !fs::remove(list, error) && error)
    return make_error(ErrorCode::kOutput, "{}: cannot remove an earlier report's file: {}",
                      list.string(), error.message());
  return Ok{};
}

Result<fs::path> write_report_folder(const Report& report, const fs::path& folder) {
  PM_TRY_STATUS(remove_report(folder));
  std::vector<std::string> files{"index.html", "junit.xml", "report.json"};
  for (const ReportCase& one : report.cases)
    if (!one.triptych_png.empty()) files.push_back(file_name(one));
  // First what lists the others, last what people open.
  PM_TRY_STATUS(write_file(folder / "report.json", dump_json(report_json(report, files))));
  for (const ReportCase& one : report.cases)
    if (!one.triptych_png.empty())
      PM_TRY_STATUS(write_file(folder / file_name(one), one.triptych_png));
  PM_TRY_STATUS(write_file(folder / "junit.xml", report_junit(report)));
  PM_TRY_STATUS(write_file(folder / "index.html", report_html(report)));
  return folder / "index.html";
}

}  // namespace polymorph
