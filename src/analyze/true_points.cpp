#include "analyze/true_points.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/file.h"
#include "base/json.h"
#include "base/text.h"
#include "mesh/closest.h"

namespace polymorph {
namespace {

/// Reads a truth file; every error names its line and column.
class TruthReader {
 public:
  TruthReader(const JsonDocument& document, std::filesystem::path folder)
      : document_(document), folder_(std::move(folder)) {}

  Result<Truth> read() const {
    Truth truth;
    const JsonValue& root = document_.root;
    PM_TRY_STATUS(expect_keys(root, "the file", {"models", "pairs"}));
    PM_TRY_STATUS(expect(root.get("models"), JsonValue::Kind::kObject, "models"));
    for (const JsonMember& member : root.get("models").members) {
      PM_TRY(TrueModel model, read_model(member));
      truth.models.push_back(std::move(model));
    }
    if (!root.contains("pairs")) return truth;
    PM_TRY_STATUS(expect(root.get("pairs"), JsonValue::Kind::kArray, "pairs"));
    for (const JsonValue& pair : root.get("pairs").items) {
      if (!pair.is_array() || pair.size() != 2)
        return make_error_at(pair, "a pair must be a list of two names of models");
      PM_TRY(const std::size_t from, find_model(truth, pair.items[0]));
      PM_TRY(const std::size_t to, find_model(truth, pair.items[1]));
      truth.pairs.emplace_back(from, to);
    }
    return truth;
  }

 private:
  /// Makes an error at the position of a value, or at the beginning of the file if the value is
  /// absent.
  Error make_error_at(const JsonValue& value, const std::string& what) const {
    const TextPosition at =
        value.offset == JsonValue::kNowhere ? TextPosition{1, 1} : document_.position(value.offset);
    return make_error(ErrorCode::kInput, "{}:{}:{}: {}", document_.name, at.line, at.column, what);
  }

  Status expect(const JsonValue& value, JsonValue::Kind kind, const std::string& name) const {
    if (value.kind == kind) return Ok{};
    const std::string actual =
        value.is_null() ? "is missing" : std::string("is ") + kind_name(value.kind);
    return make_error_at(value,
                         fmt::format("\"{}\" must be {} ({})", name, kind_name(kind), actual));
  }

  Status expect_keys(const JsonValue& object, const std::string& name,
                     const std::vector<std::string>& keys) const {
    if (!object.is_object()) return make_error_at(object, name + " must be an object");
    for (const JsonMember& member : object.members)
      if (std::find(keys.begin(), keys.end(), member.key) == keys.end())
        return make_error_at(member.value,
                             fmt::format("{} has no key \"{}\"{} - there are {}", name, member.key,
                                         did_you_mean(member.key, keys), join_quoted(keys)));
    return Ok{};
  }

  Result<TrueModel> read_model(const JsonMember& member) const {
    TrueModel model;
    model.name = member.key;
    const JsonValue& value = member.value;
    PM_TRY_STATUS(expect_keys(value, "a model", {"model", "up", "points"}));
    PM_TRY_STATUS(expect(value.get("model"), JsonValue::Kind::kString, "model"));
    model.model = (folder_ / value.get("model").string).lexically_normal();
    if (const JsonValue* up = value.find("up")) {
      if (up->string != "x" && up->string != "y" && up->string != "z")
        return make_error_at(*up, "\"up\" must be \"x\", \"y\" or \"z\"");
      model.up = up->string == "x" ? UpAxis::kX : up->string == "z" ? UpAxis::kZ : UpAxis::kY;
    }
    PM_TRY_STATUS(expect(value.get("points"), JsonValue::Kind::kObject, "points"));
    for (const JsonMember& point : value.get("points").members) {
      const std::optional<Vec3> position = read_point(point.value);
      if (!position)
        return make_error_at(point.value,
                             fmt::format("point \"{}\" must be three numbers", point.key));
      model.points[point.key] = *position;
    }
    return model;
  }

  static std::optional<Vec3> read_point(const JsonValue& value) {
    if (!value.is_array() || value.size() != 3) return std::nullopt;
    float p[3] = {};
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = static_cast<float>(value.items[k].number);
      if (!value.items[k].is_number() || !std::isfinite(p[k])) return std::nullopt;
    }
    return Vec3{p[0], p[1], p[2]};
  }

  Result<std::size_t> find_model(const Truth& truth, const JsonValue& name) const {
    std::vector<std::string> names;
    for (const TrueModel& model : truth.models) {
      if (name.is_string() && model.name == name.string) return names.size();
      names.push_back(model.name);
    }
    return make_error_at(name, fmt::format("no model is called \"{}\"{}", name.string,
                                           did_you_mean(name.string, names)));
  }

  const JsonDocument& document_;
  std::filesystem::path folder_;
};

std::filesystem::path canonical_path(const std::filesystem::path& path) {
  std::error_code failure;
  const std::filesystem::path result = std::filesystem::weakly_canonical(path, failure);
  return failure ? path.lexically_normal() : result;
}

}  // namespace

const TrueModel* Truth::find(const std::filesystem::path& model, const std::string& name) const {
  if (!model.empty())
    for (const TrueModel& entry : models)
      if (canonical_path(entry.model) == canonical_path(model)) return &entry;
  for (const TrueModel& entry : models)
    if (entry.name == name) return &entry;
  return nullptr;
}

Result<Truth> load_truth(const std::filesystem::path& file_or_folder) {
  std::error_code failure;
  const std::filesystem::path file = std::filesystem::is_directory(file_or_folder, failure)
                                         ? file_or_folder / "truth.json"
                                         : file_or_folder;
  PM_TRY(std::string text, read_file(file));
  remember_input(file);
  PM_TRY(const JsonDocument document, parse_json(file.string(), std::move(text)));
  PM_TRY(Truth truth, TruthReader(document, file.parent_path()).read());
  truth.file = file;
  return truth;
}

PointPairs pair_points(const TrueModel& from, const TrueModel& to) {
  PointPairs pairs;
  for (const auto& [name, position] : from.points)
    if (const auto other = to.points.find(name); other != to.points.end()) {
      pairs.from.push_back(position);
      pairs.to.push_back(other->second);
    }
  return pairs;
}

std::vector<Vec3> move_with_mesh(const std::vector<Vec3>& points, MeshView mesh,
                                 std::span<const Vec3> positions) {
  PM_CHECK(!mesh.triangles.empty() && positions.size() == mesh.points.size());
  std::vector<Vec3> result;
  for (const ClosestPoint& hit : ClosestPointQuery(mesh).closest(points))
    result.push_back(interpolate(positions, mesh.triangles[hit.triangle], weights_at(mesh, hit)));
  return result;
}

}  // namespace polymorph
