#include "interchange/landmarks_page.h"

#include <cmath>
#include <cstdint>
#include <span>
#include <string_view>

#include "base/html_page.h"
#include "base/json.h"
#include "base/packed_text.h"
#include "base/result.h"
#include "base/text.h"
#include "interchange/json_vectors.h"

namespace polymorph {

// The texts of landmarks.html and play.html, whose scripts both pages use (pm_embed() in
// cmake/rooms.cmake).
extern const std::string_view landmarks_page, play_page;

namespace {

/// Concatenated arrays, each aligned to four bytes.
class Blob {
 public:
  /// Appends an array. Returns {"at": offset in bytes, "count": number of scalars}.
  template <class T>
  JsonValue add(std::span<const T> values) {
    const std::size_t at = bytes_.size();
    bytes_.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    return {{"at", at}, {"count", values.size_bytes() / sizeof(typename Scalar<T>::type)}};
  }
  const std::string& bytes() const { return bytes_; }

 private:
  /// The scalar type of which T consists.
  template <class T>
  struct Scalar {
    using type = T;
  };
  std::string bytes_;
};
template <>
struct Blob::Scalar<Vec3> {
  using type = float;
};
template <>
struct Blob::Scalar<Triangle> {
  using type = std::uint32_t;
};

JsonValue transform_json(const Transform& t) {
  JsonValue numbers = JsonValue::array();
  for (const auto& row : t.m)
    for (const float v : row) numbers.push_back(v);
  return numbers;
}

JsonValue pairs_json(const std::vector<NamedPair>& pairs) {
  JsonValue list = JsonValue::array();
  for (const NamedPair& pair : pairs)
    list.push_back({{"name", pair.name}, {"from", to_array(pair.from)}, {"to", to_array(pair.to)}});
  return list;
}

JsonValue colors_json(const std::vector<Vec3>& colors, Blob& blob) {
  std::vector<std::uint8_t> bytes;
  for (const Vec3& color : colors)
    for (const float c : {color.x, color.y, color.z})
      bytes.push_back(static_cast<std::uint8_t>(std::lround(255 * c)));
  return blob.add(std::span<const std::uint8_t>(bytes));
}

/// Returns the text of the script in play.html that has this id.
std::string find_play_script(std::string_view id) {
  const std::string begin = "<script id=\"" + std::string(id) + "\">";
  const std::size_t first = play_page.find(begin);
  PM_CHECK(first != std::string_view::npos);
  const std::size_t from = first + begin.size(), end = play_page.find("</script>", from);
  PM_CHECK(end != std::string_view::npos);
  return std::string(play_page.substr(from, end - from));
}

}  // namespace

std::string encode_landmarks_page(const LandmarksPage& page) {
  PM_CHECK(!page.legs.empty());
  Blob blob;
  JsonValue json{{"title", printable(page.title)}};
  for (const LandmarksObject& object : page.objects)
    json["objects"].push_back(
        {{"key", object.key},
         {"positions", blob.add(std::span<const Vec3>(object.mesh.positions))},
         {"normals", blob.add(std::span<const Vec3>(object.mesh.normals))},
         {"triangles", blob.add(std::span<const Triangle>(object.mesh.triangles))},
         {"to_scene", transform_json(object.to_scene)},
         {"to_file", transform_json(object.to_file)}});
  for (const LandmarksLeg& leg : page.legs)
    json["legs"].push_back({{"from", leg.from},
                            {"to", leg.to},
                            {"colors", JsonValue::array({colors_json(leg.from_colors, blob),
                                                         colors_json(leg.to_colors, blob)})},
                            {"given", pairs_json(leg.landmarks)},
                            {"candidates", pairs_json(leg.candidates)}});
  return fill_page(landmarks_page, {{"{{title}}", escape_markup(page.title)},
                                    {"{{engine}}", find_play_script("engine")},
                                    {"{{drawing}}", find_play_script("drawing")},
                                    {"{{data}}", json_in_script(format_json(json))},
                                    {"{{bytes}}", pack_text(blob.bytes(), /*effort=*/6)}});
}

}  // namespace polymorph
