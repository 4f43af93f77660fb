#include "compare/explain.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>

#include "base/result.h"
#include "base/text.h"
#include "compare/channel_rule.h"
#include "compare/explain_colors.h"

namespace polymorph {
namespace {

/// Finds the value of a header entry; null if there is none.
const std::variant<std::string, int, float>* find_value(const Image& image, const char* name) {
  for (const Attribute& a : image.attributes)
    if (a.name == name) return &a.value;
  return nullptr;
}
/// Returns the values of a header entry as (actual, reference), if both images have it as a T.
template <class T>
std::optional<std::pair<T, T>> attribute_pair(const Image& actual, const Image& reference,
                                              const char* name) {
  const auto *a = find_value(actual, name), *b = find_value(reference, name);
  const T* u = a ? std::get_if<T>(a) : nullptr;
  const T* v = b ? std::get_if<T>(b) : nullptr;
  if (!u || !v) return std::nullopt;
  return std::pair(*u, *v);
}

/// Parses kObjectsAttribute: names of objects by id.
std::map<int, std::string> object_names(const Image& image) {
  std::map<int, std::string> names;
  const auto* value = find_value(image, kObjectsAttribute);
  const auto* text = value ? std::get_if<std::string>(value) : nullptr;
  if (!text) return names;
  for (std::string entry : split(*text, ',')) {
    while (!entry.empty() && entry[0] == ' ') entry.erase(0, 1);
    const auto space = entry.find(' ');
    if (space == std::string::npos) continue;
    names[static_cast<int>(parse_integer(entry.substr(0, space)).value_or(-1))] =
        entry.substr(space + 1);
  }
  return names;
}

double length_of(Vec3 a) { return static_cast<double>(length(a)); }

/// World position of the centre of a pixel (numbered row by row) at distance z along `forward`.
Vec3 unproject(const PinholeView& view, int width, int height, int pixel, float z) {
  const Vec3 right = cross(view.forward, view.up);
  const float scale = 2 * view.tan_half_fov_y / static_cast<float>(height);
  const float x =
      (static_cast<float>(pixel % width) + 0.5f - 0.5f * static_cast<float>(width)) * scale;
  const float y =
      (0.5f * static_cast<float>(height) - static_cast<float>(pixel / width) - 0.5f) * scale;
  return view.position + (view.forward + right * x + view.up * y) * z;
}
/// Pixel coordinates of a point in world space; (0, 0) is the top left corner of the picture.
Vec2 project(const PinholeView& view, int width, int height, Vec3 p) {
  const Vec3 offset = p - view.position, right = cross(view.forward, view.up);
  const float depth = dot(offset, view.forward);
  const float scale = static_cast<float>(height) / (2 * view.tan_half_fov_y * depth);
  return {0.5f * static_cast<float>(width) + dot(offset, right) * scale,
          0.5f * static_cast<float>(height) - dot(offset, view.up) * scale};
}

/// Describes a moved camera by the mean shift, in pixels, of the points that the reference shows.
std::string explain_camera(const ImagePair& pair, const PinholeView& new_view,
                           const PinholeView& old_view) {
  double sum = 0;
  int count = 0;
  for (int i = 0; i < pair.pixels(); ++i) {
    // Without depths, assume that all points are as far away as the origin.
    const float z = pair.has("Z") ? pair.reference(i, "Z") : length(old_view.position);
    if (z >= kNothingHit) continue;
    const Vec3 p = unproject(old_view, pair.width(), pair.height(), i, z);
    const Vec2 to = project(new_view, pair.width(), pair.height(), p);
    const Vec2 from = project(old_view, pair.width(), pair.height(), p);
    sum += std::hypot(static_cast<double>(to.x - from.x), static_cast<double>(to.y - from.y));
    ++count;
  }
  return fmt::format("camera moved by {:.2g} px", count > 0 ? sum / count : 0.0);
}

/// Describes moved surfaces: how many of their pixels changed, the largest shift, how many pixels
/// show another object (the outline), and the ball nearest to the largest shift. `view` is the
/// camera of the actual image, if known. Returns "" if no pixel and no digest shows a change.
std::string explain_surface(const ImagePair& pair, const std::optional<PinholeView>& view,
                            const ChangeContext& context) {
  int visible = 0, moved = 0, outline = 0;  // numbers of pixels
  double max_shift = 0;
  std::optional<Vec3> max_point;  // where the shift is largest
  // Measure the shift of each pixel that shows the same object in both images.
  for (int i = 0; i < pair.pixels(); ++i) {
    // Ids above 1 are objects; 0 is the background, 1 the floor.
    const bool in_reference = !pair.has("id") || pair.reference(i, "id") > 1;
    const bool in_actual = !pair.has("id") || pair.actual(i, "id") > 1;
    if (!in_reference && !in_actual) continue;
    ++visible;
    if (pair.equal(i, {"Z", "N.X", "N.Y", "N.Z", "id", "P.X", "P.Y", "P.Z"})) continue;
    ++moved;
    if (in_reference != in_actual || (pair.has("id") && !pair.equal(i, "id"))) {
      ++outline;
      continue;
    }
    if (!pair.has("Z")) continue;
    const float a = pair.actual(i, "Z"), b = pair.reference(i, "Z");
    if (a >= kNothingHit || b >= kNothingHit) continue;
    // Measure along the normal: at a grazing angle a small shift changes the depth a lot. The
    // cosine is at least 0.05, so that a normal perpendicular to the ray does not hide the shift.
    double cosine = 1;
    if (view && pair.has("N.X")) {
      const Vec3 normal{pair.reference(i, "N.X"), pair.reference(i, "N.Y"),
                        pair.reference(i, "N.Z")};
      const Vec3 p = unproject(*view, pair.width(), pair.height(), i, b);
      const Vec3 direction = normalized(p - view->position);
      cosine = std::max(0.05, std::fabs(static_cast<double>(dot(normal, direction))));
    }
    const double shift = std::fabs(static_cast<double>(a) - static_cast<double>(b)) * cosine;
    if (shift <= max_shift) continue;
    max_shift = shift;
    if (view) max_point = unproject(*view, pair.width(), pair.height(), i, a);
  }
  // Describe the measured shifts in words.
  if (moved == 0)
    return context.surfaces_known && !context.surfaces_equal
               ? "surface: vertices moved that no pixel shows"
               : "";
  std::string text = "surface: ";
  if (moved * 10 >= visible * 9)  // at least 90 %
    text += "all of it moved";
  else
    text += fmt::format("1 pixel in {} moved",
                        std::max(1L, std::lround(static_cast<double>(visible) / moved)));
  if (max_shift > 0 && context.cell > 0)
    text += fmt::format(", worst {:.2g} cells", max_shift / static_cast<double>(context.cell));
  else if (max_shift > 0)
    text += fmt::format(", worst {:.3g}", max_shift);
  if (outline > 0) text += fmt::format(", the outline at {} pixels", outline);
  if (max_point && !context.balls.empty()) {
    const auto nearest = std::min_element(
        context.balls.begin(), context.balls.end(),
        [&](Vec3 u, Vec3 v) { return length(u - *max_point) < length(v - *max_point); });
    text += fmt::format(", near ball {}", nearest - context.balls.begin());
  }
  return text;
}

/// Describes changed albedo per object. If at least 90 % of the object's pixels changed, by nearly
/// the same factor, the cause is its colour, else its texture.
std::string explain_albedo(const ImagePair& pair) {
  struct Object {
    int visible = 0, changed = 0;
    double sum = 0, squares = 0;  // of the ratio of albedos, over changed pixels
  };
  std::map<int, Object> objects;
  for (int i = 0; i < pair.pixels(); ++i) {
    Object& object = objects[static_cast<int>(pair.reference(i, "id"))];
    ++object.visible;
    if (pair.equal(i, {"albedo.R", "albedo.G", "albedo.B"})) continue;
    ++object.changed;
    // 1e-6 avoids a division by zero where the albedo is black.
    const double ratio = (length_of(pair.color(/*of_actual=*/true, i, "albedo.")) + 1e-6) /
                         (length_of(pair.color(/*of_actual=*/false, i, "albedo.")) + 1e-6);
    object.sum += ratio;
    object.squares += ratio * ratio;
  }
  const std::map<int, std::string> names = object_names(pair.actual_image());
  std::string text;
  for (const auto& [id, object] : objects) {
    if (object.changed == 0) continue;
    const double mean = object.sum / object.changed;
    const double deviation =
        std::sqrt(std::max(0.0, object.squares / object.changed - mean * mean));
    const bool uniform = object.changed * 10 >= object.visible * 9 && deviation < 0.1 * mean;
    const auto name = names.find(id);
    const std::string subject = id == 1               ? "the floor"
                                : id == 0             ? "what nothing hit"
                                : name != names.end() ? "`" + name->second + "`"
                                                      : fmt::format("object {}", id);
    text += fmt::format(
        "{}albedo differs on {}{}: {}", text.empty() ? "" : ", ", subject,
        uniform ? "" : fmt::format(" at {} of {} pixels", object.changed, object.visible),
        uniform ? "colour" : "texture");
  }
  return text;
}

/// Describes changed light, of the whole picture or as reflected by one object.
std::string explain_light(const ImagePair& pair) {
  // Without ids, name the changed rectangle if it is small.
  if (!pair.has("id"))
    if (const std::string region = explain_region(pair); !region.empty()) return region;
  // Without geometric layers, only the edges can show whether the shapes are the same.
  const bool has_geometry = pair.has("id") || pair.has("Z") || pair.has("N.X") || pair.has("P.X");
  if (!has_geometry)
    return edges_stay(pair) ? "the edges stay: light or colours differ"
                            : "the edges moved: shapes, shadows or textures differ";
  // A light changes floor and background everywhere. A material changes at most 4 % (1/25) of their
  // pixels by more than 1 %. If it is a material, name the object whose colours changed most.
  std::map<int, double> changes;    // sum of the colours' differences, by id
  int background = 0, changed = 0;  // pixels of floor and background (ids 0 and 1)
  for (int i = 0; i < pair.pixels(); ++i) {
    const int id = static_cast<int>(pair.reference(i, "id"));
    const Vec3 old_color = pair.color(/*of_actual=*/false, i, "");
    const double change = length_of(pair.color(/*of_actual=*/true, i, "") - old_color);
    if (id > 1) {
      changes[id] += change;
      continue;
    }
    ++background;
    changed += change > 0.01 * length_of(old_color);
  }
  if (changes.empty() || !pair.has("id") || changed * 25 > background) return "only light differs";
  const int most_changed = std::max_element(changes.begin(), changes.end(), [](auto& a, auto& b) {
                             return a.second < b.second;
                           })->first;
  const std::map<int, std::string> names = object_names(pair.actual_image());
  const auto name = names.find(most_changed);
  return fmt::format(
      "geometry and albedo equal, {} reflects light differently: roughness, metal or specular",
      name != names.end() ? "`" + name->second + "`" : fmt::format("object {}", most_changed));
}

/// Describes changed numbers of balls. The header entries read "cube 12, sphere 12".
std::string explain_balls(const Image& actual, const Image& reference) {
  const auto texts = attribute_pair<std::string>(actual, reference, kBallsAttribute);
  if (!texts || texts->first == texts->second) return "";
  const std::vector<std::string> new_entries = split(texts->first, ','),
                                 old_entries = split(texts->second, ',');
  if (new_entries.size() != old_entries.size()) return "other objects";
  std::string text;
  for (std::size_t i = 0; i < new_entries.size(); ++i) {
    const auto count = [](const std::string& entry) {
      return parse_integer(entry.substr(entry.rfind(' ') + 1)).value_or(0);
    };
    const std::int64_t a = count(new_entries[i]), b = count(old_entries[i]);
    if (a == b) continue;
    std::string name = new_entries[i].substr(0, new_entries[i].rfind(' '));
    while (name.starts_with(' ')) name.erase(0, 1);
    text += fmt::format("{}{} of `{}`, {} in place of {}", text.empty() ? "" : "; ",
                        a == b - 1 ? "a ball is missing"
                        : a < b    ? "balls are missing"
                                   : "more balls",
                        name, a, b);
  }
  return text.empty() ? "other objects" : text;
}

/// Describes why the noise differs: other samples per pixel or another seed, if the headers say so.
std::string explain_noise(const Image& actual, const Image& reference) {
  if (const auto samples = attribute_pair<int>(actual, reference, kSamplesAttribute);
      samples && samples->first != samples->second)
    return fmt::format("only noise differs: {} samples in place of {}", samples->first,
                       samples->second);
  if (const auto seed = attribute_pair<std::string>(actual, reference, kSeedAttribute);
      seed && seed->first != seed->second)
    return fmt::format("only noise differs: seed {} in place of {}", seed->first, seed->second);
  return "only noise differs (seed or samples)";
}

}  // namespace

std::string pinhole_view_text(const PinholeView& view) {
  const auto& [p, f, u, tan] = view;
  return fmt::format("{} {} {}  {} {} {}  {} {} {}  {}", p.x, p.y, p.z, f.x, f.y, f.z, u.x, u.y,
                     u.z, tan);
}

bool parse_view(const std::string& text, PinholeView& view) {
  auto& [p, f, u, tan] = view;
  return std::sscanf(text.c_str(), "%f %f %f %f %f %f %f %f %f %f", &p.x, &p.y, &p.z, &f.x, &f.y,
                     &f.z, &u.x, &u.y, &u.z, &tan) == 10;
}

std::string explain_change(const Image& actual, const Image& reference,
                           const ChangeContext& context) {
  // Test the possible causes in order, and return the first that fits: camera, geometry, albedo,
  // layers beside the colours, brightness or gamma, rounding, noise, light. Images that are equal
  // may still have different surfaces.
  const ImagePair pair(actual, reference);
  if (!pair.comparable() || actual.pixels == reference.pixels) {
    if (!pair.comparable() || !context.surfaces_known || context.surfaces_equal) return "";
  }
  std::optional<PinholeView> view;
  std::string camera;
  if (const auto texts = attribute_pair<std::string>(actual, reference, kCameraAttribute)) {
    PinholeView new_view, old_view;
    if (parse_view(texts->first, new_view) && parse_view(texts->second, old_view)) {
      view = new_view;
      if (texts->first != texts->second) camera = explain_camera(pair, new_view, old_view);
    }
  }
  const bool surfaces_equal = context.surfaces_known && context.surfaces_equal;
  if (!camera.empty() && (surfaces_equal || !context.surfaces_known)) return camera;
  const bool geometry_equal = pair.equal({"Z", "N.X", "N.Y", "N.Z", "id", "P.X", "P.Y", "P.Z"}) &&
                              (!context.surfaces_known || context.surfaces_equal);
  if (!geometry_equal) {
    std::string causes;
    const auto plan = attribute_pair<std::string>(actual, reference, kPlanAttribute);
    if (const std::string balls = explain_balls(actual, reference); !balls.empty())
      causes = balls;
    else if (plan && plan->first != plan->second)
      causes = "plan: other balls become other balls";
    const std::string surface = explain_surface(pair, view, context);
    for (const std::string& cause : {camera, surface})
      if (!cause.empty()) causes += (causes.empty() ? "" : "; ") + cause;
    return causes;
  }
  if (pair.has("albedo.R") && !pair.equal({"albedo.R", "albedo.G", "albedo.B"}))
    return "geometry equal, " + explain_albedo(pair);
  if (!pair.has("R") || pair.equal({"R", "G", "B"})) {
    if (pair.has("A") && !pair.equal({"A"})) return "only alpha differs";
    std::string names;
    for (const std::string& channel : reference.channels)
      if (!pair.equal({channel.c_str()})) names += (names.empty() ? "" : ", ") + channel;
    return names.empty() ? "" : "only the layers differ: " + names;
  }
  if (const std::string curve = explain_curve(pair); !curve.empty()) return curve;
  if (is_only_rounding(pair))
    return "only rounding differs, by no more than one step of 8 bits: dither";
  if (is_only_noise(pair)) return explain_noise(actual, reference);
  return explain_light(pair);
}

}  // namespace polymorph
