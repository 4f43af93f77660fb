#include "model/load/obj_scan.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "base/text.h"
#include "model/load/text_lines.h"

namespace polymorph {
namespace {

class Scanner {
 public:
  Scanner(std::string_view text, std::string file)
      : lines_(text), file_(std::move(file)), errors_(file_) {}

  Result<ObjScan> scan() {
    while (lines_.next() && !errors_.full()) scan_line(lines_.line());
    if (!errors_.full()) check_ranges();
    if (!errors_.empty()) return errors_.error();
    if (result_.point_count() == 0 || result_.faces.empty()) return make_no_faces_error();
    report_occurrences();
    apply_point_colors();
    return std::move(result_);
  }

 private:
  void scan_line(std::string_view line);
  /// Numbers per line: `used` are stored, at least `min` are required, at most `max` are allowed.
  struct RealCounts {
    int used, min, max;
  };
  int scan_reals(std::string_view text, std::vector<float>& values, RealCounts counts,
                 const char* element);
  void scan_point(std::string_view text);
  void apply_point_colors();
  void scan_face(std::string_view text);
  std::optional<ObjCorner> scan_corner(std::string_view word);
  /// Parses an index of a face corner; returns it counted from 0, or -1 for the index 0. Negative
  /// indices count back from the last of the `count` elements read so far.
  std::optional<std::int64_t> parse_index(std::string_view digits, std::uint32_t count,
                                          const char* element);
  void check_ranges();
  bool check_corner(const ObjCorner& corner, std::uint32_t line);
  void report(const Occurrences& events, const char* singular, const char* plural);
  void report_occurrences();
  Error make_no_faces_error() const;
  /// Indices in result_ of the current label and material (-1: none), which these functions add on
  /// first use.
  std::uint32_t label_index();
  std::int32_t material_index();
  /// Number of vectors in a flat list of their components.
  std::uint32_t count(const std::vector<float>& values, unsigned dimension) const {
    return static_cast<std::uint32_t>(values.size() / dimension);
  }
  void fail(const std::string& text) { errors_.add(lines_.number(), text); }

  LineReader lines_;
  std::string file_;
  ErrorList errors_;
  ObjScan result_;
  std::vector<float> point_numbers_;  ///< numbers of the current v line
  std::string object_, group_;        ///< current names
  NamedLine material_;                ///< current usemtl
  std::map<std::string, std::uint32_t> label_indices_;
  std::map<std::string, std::int32_t> material_indices_;
  /// Indices of the current label and material; unset until the next face needs them.
  std::optional<std::uint32_t> current_label_;
  std::optional<std::int32_t> current_material_ = -1;
  Occurrences lines_and_points_, curves_, unknown_, few_corners_, zero_normals_, zero_uvs_,
      odd_vertex_sizes_;
  std::vector<float> colors_;  ///< 3 per point, kUnknownColor where the line has none; or empty
};

void Scanner::scan_line(std::string_view line) {
  if (line.empty() || line.front() == '#') return;
  std::string_view text = line;
  const std::string_view word = take_word(text);
  if (word == "v") {
    scan_point(text);
  } else if (word == "vt") {
    scan_reals(text, result_.uvs, {2, 1, 3}, "texture coordinate");
  } else if (word == "vn") {
    scan_reals(text, result_.normals, {3, 3, 3}, "normal");
  } else if (word == "f" || word == "fo") {
    scan_face(text);
  } else if (word == "g") {
    group_ = printable(trim(text));
    current_label_.reset();
  } else if (word == "o") {
    object_ = printable(trim(text));
    group_.clear();
    current_label_.reset();
  } else if (word == "usemtl") {
    material_ = {std::string(trim(text)), lines_.number()};
    current_material_.reset();
  } else if (word == "mtllib") {
    if (!trim(text).empty())
      result_.libraries.push_back({std::string(trim(text)), lines_.number()});
  } else if (word == "l" || word == "p") {
    lines_and_points_.note(lines_.number());
  } else if (word == "curv" || word == "curv2" || word == "surf" || word == "cstype") {
    curves_.note(lines_.number());
  } else {
    static constexpr std::array<std::string_view, 20> kIgnored{
        "s",   "vp",  "deg", "bmat",  "step",     "parm",     "trim", "hole", "scrv",   "sp",
        "end", "con", "mg",  "bevel", "c_interp", "d_interp", "lod",  "vw",   "maplib", "usemap"};
    if (std::find(kIgnored.begin(), kIgnored.end(), word) == kIgnored.end())
      unknown_.note(lines_.number());
  }
}

/// Scans "x y z", "x y z w" or, as 3D scanners write it, "x y z r g b" with an optional alpha,
/// which is ignored.
void Scanner::scan_point(std::string_view text) {
  std::vector<float>& numbers = point_numbers_;
  numbers.clear();
  const int count = scan_reals(text, numbers, {7, 3, 8}, "vertex");
  result_.positions.insert(result_.positions.end(), numbers.begin(), numbers.begin() + 3);
  const bool is_colored = count == 6 || count == 7;
  if (!is_colored && count > 4) odd_vertex_sizes_.note(lines_.number());
  if (!is_colored && colors_.empty()) return;
  colors_.resize(result_.positions.size(), kUnknownColor);
  if (is_colored) std::copy_n(numbers.begin() + 3, 3, colors_.end() - 3);
}

/// Appends `counts.used` numbers to `values` whatever the line holds, so that later indices stay
/// valid after a bad line. Returns how many numbers the line has.
int Scanner::scan_reals(std::string_view text, std::vector<float>& values, RealCounts counts,
                        const char* element) {
  const auto [used_count, min_count, max_count] = counts;
  const std::size_t size = values.size();
  int count_read = 0;
  // A comment may follow the numbers.
  for (std::string_view word = take_word(text); !word.empty() && !word.starts_with("#");
       word = take_word(text)) {
    const ParsedReal real = parse_real(word);
    if (real.problem) {
      fail(fmt::format("{} number {} \"{}\" {}", element, count_read + 1, printable(word),
                       real.problem));
      count_read = min_count;  // suppresses the error below: one per line is enough
      break;
    }
    if (count_read < used_count) values.push_back(real.value);
    if (++count_read > max_count) {
      fail(fmt::format("{} has more than {} numbers", element, max_count));
      break;
    }
  }
  if (count_read < min_count)
    fail(fmt::format("{} has {} of {} numbers - the file is damaged or cut short", element,
                     count_read, min_count));
  values.resize(size + static_cast<std::size_t>(used_count));
  return count_read;
}

std::optional<std::int64_t> Scanner::parse_index(std::string_view digits, std::uint32_t count,
                                                 const char* element) {
  if (digits.starts_with('+')) digits.remove_prefix(1);
  std::int64_t index = 0;
  const auto [stop, error] = std::from_chars(digits.data(), digits.data() + digits.size(), index);
  constexpr std::int64_t kMax = std::numeric_limits<std::int32_t>::max();
  if (error == std::errc::result_out_of_range || index > kMax || index < -kMax) {
    fail(fmt::format("{} index {} is beyond the 32-bit range", element, digits));
    return std::nullopt;
  }
  if (error != std::errc{} || stop != digits.data() + digits.size()) {
    fail(fmt::format("{} index \"{}\" is not a whole number", element, printable(digits)));
    return std::nullopt;
  }
  if (index >= 0) return index - 1;
  if (-index > count) {
    fail(fmt::format("relative {} index {} reaches before the start ({} given so far)", element,
                     index, count));
    return std::nullopt;
  }
  return count + index;
}

/// Scans "v", "v/vt", "v//vn" or "v/vt/vn".
std::optional<ObjCorner> Scanner::scan_corner(std::string_view word) {
  std::array<std::string_view, 3> fields;
  std::size_t field_count = 0;
  for (std::string_view text = word; field_count < 3; ++field_count) {
    const std::size_t slash = text.find('/');
    fields[field_count] = text.substr(0, slash);
    if (slash == std::string_view::npos) {
      ++field_count;
      break;
    }
    text.remove_prefix(slash + 1);
    if (field_count == 2) {
      fail(fmt::format("face corner \"{}\" has more than three indices", printable(word)));
      return std::nullopt;
    }
  }
  ObjCorner corner;
  const auto v = parse_index(fields[0], result_.point_count(), "vertex");
  if (!v) return std::nullopt;
  corner.v = static_cast<std::int32_t>(*v);
  if (corner.v < 0) {
    fail("vertex index 0 in a face - OBJ counts from 1");
    return std::nullopt;
  }
  if (field_count > 1 && !fields[1].empty()) {
    const auto vt = parse_index(fields[1], count(result_.uvs, 2), "texture coordinate");
    if (!vt) return std::nullopt;
    corner.vt = static_cast<std::int32_t>(*vt);
    if (corner.vt < 0) zero_uvs_.note(lines_.number());
  }
  if (field_count > 2 && !fields[2].empty()) {
    const auto vn = parse_index(fields[2], count(result_.normals, 3), "normal");
    if (!vn) return std::nullopt;
    corner.vn = static_cast<std::int32_t>(*vn);
    if (corner.vn < 0) zero_normals_.note(lines_.number());
  }
  return corner;
}

void Scanner::scan_face(std::string_view text) {
  ObjFace face;
  face.line = lines_.number();
  const std::size_t first = result_.corners.size();
  text = text.substr(0, text.find('#'));  // a comment may follow without a space
  for (std::string_view word = take_word(text); !word.empty(); word = take_word(text)) {
    if (++face.corners > kMaxFaceCorners) {
      fail(fmt::format("face has more than {} corners - split it", kMaxFaceCorners));
      result_.corners.resize(first);
      return;
    }
    const auto corner = scan_corner(word);
    if (!corner) {
      result_.corners.resize(first);
      return;
    }
    result_.corners.push_back(*corner);
  }
  if (face.corners < 3) {
    few_corners_.note(face.line);
    result_.corners.resize(first);
    return;
  }
  face.label = label_index();
  face.material = material_index();
  result_.faces.push_back(face);
}

std::uint32_t Scanner::label_index() {
  if (!current_label_) {
    const std::string& name = !group_.empty() ? group_ : object_;
    const auto [it, added] = label_indices_.try_emplace(
        name.empty() ? "default" : name, static_cast<std::uint32_t>(result_.labels.size()));
    if (added) result_.labels.push_back(it->first);
    current_label_ = it->second;
  }
  return *current_label_;
}

std::int32_t Scanner::material_index() {
  // A usemtl line without a name selects no material.
  if (!current_material_ && material_.name.empty()) current_material_ = -1;
  if (!current_material_) {
    const auto [it, added] = material_indices_.try_emplace(
        material_.name, static_cast<std::int32_t>(result_.materials.size()));
    if (added) result_.materials.push_back(material_);
    current_material_ = it->second;
  }
  return *current_material_;
}

bool Scanner::check_corner(const ObjCorner& corner, std::uint32_t line) {
  const auto check = [&](std::int64_t index, std::uint32_t limit, const char* element) {
    if (index < static_cast<std::int64_t>(limit)) return true;
    errors_.add(line,
                fmt::format("{} index {} is beyond the {} of the file", element, index + 1, limit));
    return false;
  };
  return check(corner.v, result_.point_count(), "vertex") &&
         check(corner.vt, count(result_.uvs, 2), "texture coordinate") &&
         check(corner.vn, count(result_.normals, 3), "normal");
}

// Runs after the whole file is read, because faces may precede the vertices that they use.
void Scanner::check_ranges() {
  std::size_t next = 0;
  for (const ObjFace& face : result_.faces) {
    const std::size_t first = next;
    next += face.corners;
    for (std::size_t i = first; i < next; ++i)
      if (!check_corner(result_.corners[i], face.line)) break;
  }
}

Error Scanner::make_no_faces_error() const {
  if (few_corners_.count > 0)
    return make_error(ErrorCode::kInput, "{}:{}: no faces: {} fewer than 3 corners", file_,
                      few_corners_.first_line,
                      few_corners_.count == 1 ? "the only one has"
                                              : fmt::format("all {} have", few_corners_.count));
  if (curves_.count > 0)
    return make_error(
        ErrorCode::kInput,
        "{}:{}: no faces: free-form curves and surfaces are not read - export polygons", file_,
        curves_.first_line);
  if (unknown_.count > 0 && result_.point_count() == 0)
    return make_error(
        ErrorCode::kInput, "{}:{}: no faces: {} with an unknown word - is this a Wavefront OBJ?",
        file_, unknown_.first_line,
        unknown_.count == 1 ? "1 line starts" : fmt::format("{} lines start", unknown_.count));
  return make_error(ErrorCode::kInput, "{}: no faces ({} vert{}) - export the model with its faces",
                    file_, result_.point_count(), result_.point_count() == 1 ? "ex" : "ices");
}

void Scanner::report(const Occurrences& events, const char* singular, const char* plural) {
  if (events.count == 0) return;
  result_.warnings.push_back(fmt::format("{}:{}: {} {}", file_, events.first_line, events.count,
                                         events.count == 1 ? singular : plural));
}

void Scanner::report_occurrences() {
  report(few_corners_, "face with fewer than 3 corners - dropped",
         "faces with fewer than 3 corners - dropped");
  report(zero_normals_, "normal index is 0 - the computed normal is used there",
         "normal indices are 0 - computed normals are used there");
  report(zero_uvs_, "texture coordinate index is 0 - dropped",
         "texture coordinate indices are 0 - dropped");
  report(lines_and_points_, "line or point element - ignored", "line or point elements - ignored");
  report(curves_, "free-form element - ignored", "free-form elements - ignored");
  report(odd_vertex_sizes_, "vertex with 5 or 8 numbers - what follows the position is ignored",
         "vertices with 5 or 8 numbers - what follows the position is ignored");
  report(unknown_, "line starts with an unknown word - ignored",
         "lines start with an unknown word - ignored");
}

/// Colours the faces by their points. Colours that are white everywhere are ignored, because many
/// programs write them beside a material.
void Scanner::apply_point_colors() {
  colors_.resize(colors_.empty() ? 0 : result_.positions.size(), kUnknownColor);
  if (std::any_of(colors_.begin(), colors_.end(),
                  [](float c) { return c != kUnknownColor && c < 1; }))
    color_faces(result_, colors_);
}

}  // namespace

void color_faces(ObjScan& scan, std::span<const float> colors) {
  if (colors.empty()) return;
  std::size_t next = 0;
  for (ObjFace& face : scan.faces) {
    std::array<double, 3> sum{};
    bool all_known = true;
    for (std::uint32_t k = 0; k < face.corners; ++k) {
      const float* color = &colors[3 * static_cast<std::size_t>(scan.corners[next++].v)];
      all_known = all_known && color[0] != kUnknownColor;
      for (std::size_t c = 0; c < 3; ++c)
        sum[c] += std::clamp(static_cast<double>(color[c]), 0.0, 1.0);
    }
    if (!all_known) continue;
    face.color = 0;
    for (const double v : sum) {
      const int step = static_cast<int>(std::lround(v / face.corners * 255 / 4));
      face.color = face.color << 8 | std::min(4 * step, 255);
    }
  }
}

Result<ObjScan> scan_obj(std::string_view bytes, const std::string& file) {
  PM_TRY(const std::string_view text, check_text(bytes, file));
  return Scanner(text, file).scan();
}

}  // namespace polymorph
