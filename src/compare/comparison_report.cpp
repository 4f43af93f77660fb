#include "compare/comparison_report.h"

#include <algorithm>
#include <set>
#include <string_view>

#include "base/file.h"
#include "base/html_page.h"
#include "base/json.h"
#include "base/text.h"
#include "compare/pictures.h"
#include "compare/report_data.h"
#include "image/image_io.h"
#include "image/strip.h"

namespace polymorph {

extern const std::string_view report_page;  // report.html

namespace {

namespace fs = std::filesystem;

constexpr int kThumbnailWidth = 168;  // pixels; twice the width of a picture in the list
constexpr int kMaxWidth = 2048;       // pixels; pictures in the page are shrunk to this width

Image shrink_to_width(const Image& image, int width) {
  if (image.width <= width) return image;
  const auto height = static_cast<int>(std::int64_t{image.height} * width / image.width);
  return resize_image(image, width, std::max(1, height));
}

/// Encodes an image, shrunk to at most `width`, as PNG, and counts its bytes.
Status encode_into(std::string& png, const Image& image, int width, PictureBudget& budget) {
  PM_TRY(png, encode_png(shrink_to_width(image, width)));
  budget.used += png.size();
  return Ok{};
}

bool same_size(const Image& a, const Image& b) {
  return a.width == b.width && a.height == b.height;
}

/// Places an image in the top left corner of a black canvas, because swiping and flipping need two
/// pictures of one size.
Image place_on_canvas(const Image& image, int width, int height) {
  Image canvas = make_image(width, height, {"R", "G", "B"});
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < 3; ++c) canvas.at(x, y, c) = image.at(x, y, c);
  return canvas;
}

/// Makes a file name from a case's name ("new.0001.exr", "frame 12"): drops the extension and
/// replaces spaces by "." and slashes by "_".
std::string picture_name(const std::string& group, const std::string& case_name) {
  std::string name = fs::path(case_name).replace_extension().string();
  if (!group.empty()) name = group + "." + name;
  for (char& c : name)
    if (c == ' ')
      c = '.';
    else if (c == '/' || c == '\\')
      c = '_';
  return name + ".png";
}
std::string picture_name(const ReportCase& result) {
  return picture_name(result.group, result.name);
}

/// Makes the JSON of a case for the page, with its pictures.
JsonValue page_case(const ReportCase& result) {
  auto entry = case_json(result);
  entry["width"] = result.width;
  entry["height"] = result.height;
  entry["shown_width"] = std::min(result.width, kMaxWidth);
  entry["shown_height"] =
      result.width > kMaxWidth
          ? std::max(1, static_cast<int>(std::int64_t{result.height} * kMaxWidth / result.width))
          : result.height;
  if (result.comparison && result.comparison->flip)
    entry["heat_range"] = heat_range(result.comparison->flip->max);
  entry["pictures"] = JsonValue::object();
  const std::pair<const char*, const std::string*> pictures[] = {
      {"reference", &result.reference_png},
      {"actual", &result.actual_png},
      {"heat", &result.heat_png},
      {"limits", &result.limits_png},
      {"thumbnail", &result.thumbnail_png}};
  for (const auto& [name, png] : pictures)
    if (!png->empty()) entry["pictures"][name] = base64(*png);
  if (result.actual_png.empty() && !result.thumbnail_png.empty())
    entry["pictures_note"] = "Left out, to keep the page small: compare the files named below.";
  return entry;
}

/// Lists the files that a report.json names, except for those that a report never writes: it writes
/// index.html, junit.xml, report.json and a picture per case. Empty if the report.json is not
/// polymorph's.
std::vector<std::string> listed_files(const fs::path& report_json) {
  const auto text = read_file(report_json, 256 << 20);  // at most 256 MiB
  if (!text) return {};
  const auto document = parse_json(report_json.string(), *text);
  if (!document) return {};
  const JsonValue& json = document->root;
  if (!json.contains("polymorph_report") || !json.contains("cases")) return {};
  std::set<std::string> possible_names{"index.html", "junit.xml", "report.json"};
  for (const JsonValue& entry : json.get("cases").items)
    possible_names.insert(picture_name(entry.get("group").string, entry.get("name").string));
  std::vector<std::string> names;
  for (const JsonValue& entry : json.get("polymorph_report").items)
    if (possible_names.contains(entry.string)) names.push_back(entry.string);
  return names;
}

/// Tests by its contents whether a report wrote this file.
bool is_written_by_report(const fs::path& file) {
  const auto bytes = read_file(file, 256 << 20);  // at most 256 MiB
  if (!bytes) return false;
  const std::string name = file.filename().string();
  if (name == "report.json") return true;  // listed_files() has read it
  if (name == "junit.xml") return bytes->find("<testsuites") != std::string::npos;
  if (name == "index.html")
    return bytes->find("type=\"application/json\" id=\"data\"") != std::string::npos;
  return bytes->starts_with("\x89PNG");
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

Status add_pictures(ReportCase& result, const Image& actual, const Image* reference,
                    const PixelMaps& maps, PictureBudget& budget) {
  result.width = std::max(actual.width, reference ? reference->width : 0);
  result.height = std::max(actual.height, reference ? reference->height : 0);
  if (result.width < 1 || result.height < 1) return Ok{};
  Image shown_actual = place_on_canvas(visible_colors(actual), result.width, result.height);
  // The list shows a thumbnail if there is no room for full pictures, or if they are much larger.
  const bool has_room = budget.used < (result.passed() ? budget.passing : budget.failing);
  if (!has_room || result.width > 2 * kThumbnailWidth)
    PM_TRY_STATUS(encode_into(result.thumbnail_png, shown_actual, kThumbnailWidth, budget));
  // A failure has a picture file of its own, which does not count towards the budget of the page.
  if (!result.passed() && reference) {
    PM_TRY(const Image triptych, result.comparison
                                     ? failure_picture(actual, *reference, *result.comparison, maps)
                                     : Result<Image>(difference_triptych(actual, *reference)));
    PM_TRY(result.triptych_png, encode_png(triptych, {.effort = PngEffort::kSmall}));
  } else if (!result.passed()) {
    PM_TRY(result.triptych_png, encode_png(shown_actual, {.effort = PngEffort::kSmall}));
  }
  // Make the full pictures of the page: new, reference, heat and limits.
  if (!has_room) return Ok{};
  PM_TRY_STATUS(encode_into(result.actual_png, shown_actual, kMaxWidth, budget));
  if (!reference) return Ok{};
  PM_TRY_STATUS(encode_into(
      result.reference_png,
      place_on_canvas(visible_colors(*reference), result.width, result.height), kMaxWidth, budget));
  if (!same_size(actual, *reference) || maps.states.empty()) return Ok{};
  if (!maps.flip.empty()) {
    const double range = heat_range(result.comparison->flip->max);
    PM_TRY_STATUS(encode_into(result.heat_png,
                              heat_picture(maps.flip, result.width, result.height, range),
                              kMaxWidth, budget));
  }
  const bool has_failing_pixels = std::any_of(maps.states.begin(), maps.states.end(),
                                              [](PixelState s) { return s >= PixelState::kOver; });
  if (has_failing_pixels)
    PM_TRY_STATUS(
        encode_into(result.limits_png, limits_picture(*reference, maps.states), kMaxWidth, budget));
  return Ok{};
}

std::string make_page(const std::string& title, JsonValue data) {
  // Sort failures first (those without FLIP, then by descending FLIP), then warnings, then passed
  // cases in their order.
  const auto rank = [](const JsonValue& c) {
    if (c.get("passed").boolean) return std::pair(c.get("warned").boolean ? 1 : 2, 0.0);
    return std::pair(0, c.contains("flip") ? -c.get("flip").get("mean").number : -1e9);
  };
  std::vector<JsonValue>& cases = data["cases"].items;
  std::stable_sort(cases.begin(), cases.end(),
                   [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
  return fill_page(report_page, {{"{{title}}", escape_markup(title)},
                                 {"{{data}}", json_in_script(dump_json(data, -1))}});
}

std::string report_html(const Report& report) {
  JsonValue facts = JsonValue::array();
  for (const auto& [name, value] : report.facts) facts.push_back(JsonValue::array({name, value}));
  JsonValue data{{"title", report.title}, {"facts", facts}};
  data["notes"] = report.notes;
  data["cases"] = JsonValue::array();
  for (const ReportCase& result : report.cases) data["cases"].push_back(page_case(result));
  return make_page(report.title, std::move(data));
}

Status remove_report(const fs::path& folder) {
  const fs::path list = folder / "report.json";
  std::error_code error;
  if (!fs::is_regular_file(fs::symlink_status(list, error))) return Ok{};
  const std::vector<std::string> names = listed_files(list);
  // If one file is an input of this run, remove none.
  for (const std::string& name : names) PM_TRY_STATUS(check_writable(folder / name));
  const auto remove = [&](const fs::path& file) -> Status {
    if (fs::remove(file, error) || !error) return Ok{};
    return make_error(ErrorCode::kOutput, "{}: cannot remove an earlier report's file: {}",
                      file.string(), error.message());
  };
  for (const std::string& name : names) {
    // report.json is removed last, so that an interrupted removal can be repeated.
    const fs::path file = folder / name;
    if (name != "report.json" && fs::is_regular_file(fs::symlink_status(file, error)) &&
        is_written_by_report(file))
      PM_TRY_STATUS(remove(file));
  }
  return names.empty() ? Status(Ok{}) : remove(list);
}

Result<fs::path> write_report_folder(const Report& report, const fs::path& folder, bool overwrite) {
  PM_TRY_STATUS(remove_report(folder));
  std::vector<std::string> files{"index.html", "junit.xml", "report.json"};
  for (const ReportCase& result : report.cases)
    if (!result.triptych_png.empty()) files.push_back(picture_name(result));
  for (const std::string& name : files) PM_TRY_STATUS(check_output(folder / name, overwrite));
  // Write the list of the files first, and the page that people open last.
  PM_TRY_STATUS(write_file(folder / "report.json", dump_json(report_json(report, files))));
  for (const ReportCase& result : report.cases)
    if (!result.triptych_png.empty())
      PM_TRY_STATUS(write_file(folder / picture_name(result), result.triptych_png));
  PM_TRY_STATUS(write_file(folder / "junit.xml", report_junit(report)));
  PM_TRY_STATUS(write_file(folder / "index.html", report_html(report)));
  return folder / "index.html";
}

}  // namespace polymorph
