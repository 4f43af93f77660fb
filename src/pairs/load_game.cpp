#include "pairs/load_game.h"

#include <algorithm>
#include <sstream>

#include "base/file.h"
#include "base/json.h"
#include "base/text.h"
#include "scene/scene.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxSide = 12;  // maximum number of columns and of rows
constexpr int kMaxLevels = 20;

/// Reads the members of one object, and keeps the message of the first error. `where` is the
/// object's place in the file, for messages: "/levels/0".
class Members {
 public:
  Members(const JsonValue& object, std::string where) : object_(object), where_(std::move(where)) {
    if (!object.is_object()) fail("", "must be an object {...}");
  }
  // Each of these functions reads a member into `out`. If the member is absent, `out` keeps its
  // value. Numbers must lie in [low, high].
  void number(const char* key, double& out, double low, double high) {
    const JsonValue* value = find(key);
    if (!value) return;
    if (!value->is_number() || !(value->number >= low && value->number <= high))
      return fail(key, fmt::format("must be a number from {} to {}", low, high));
    out = value->number;
  }
  void integer(const char* key, int& out, int low, int high) {
    const JsonValue* value = find(key);
    if (!value) return;
    if (!value->integral || value->integer < low || value->integer > high)
      return fail(key, fmt::format("must be a whole number from {} to {}", low, high));
    out = static_cast<int>(value->integer);
  }
  void seed(const char* key, std::uint64_t& out) {
    const JsonValue* value = find(key);
    if (!value) return;
    // A number of 2^63 and more is not `integral`, but has exceeds_int64.
    if (!value->exceeds_int64 && !(value->integral && value->integer >= 0))
      return fail(key, "must be a whole number, 0 or more");
    out = static_cast<std::uint64_t>(value->integer);
  }
  void text(const char* key, std::string& out) {
    const JsonValue* value = find(key);
    if (!value) return;
    if (!value->is_string()) return fail(key, "must be a string");
    out = value->string;
  }
  void texts(const char* key, std::vector<std::string>& out) {
    const JsonValue* value = find(key);
    if (!value) return;
    if (!value->is_array() || !std::all_of(value->items.begin(), value->items.end(),
                                           [](const JsonValue& item) { return item.is_string(); }))
      return fail(key, "must be a list of strings");
    out.clear();
    for (const JsonValue& item : value->items) out.push_back(item.string);
  }
  /// Returns a member, or null if it is absent. Makes `key` a known key.
  const JsonValue* find(const char* key) {
    known_.emplace_back(key);
    return object_.find(key);
  }
  void fail(const std::string& key, const std::string& what) {
    if (!error_.empty()) return;
    error_ = where_ + (key.empty() ? "" : "/" + key) + ": " + what;
  }
  /// Returns the first error, unknown keys included; empty if there is none.
  std::string finish() {
    for (const JsonMember& member : object_.members)
      if (std::find(known_.begin(), known_.end(), member.key) == known_.end())
        fail(member.key, "unknown key" + did_you_mean(member.key, known_));
    return error_;
  }

 private:
  const JsonValue& object_;
  std::string where_, error_;
  std::vector<std::string> known_;
};

/// Reads the rules. Returns an error or "".
std::string read_rules(const JsonValue& json, PairsRules& rules) {
  Members members(json, "/rules");
  constexpr double kMaxSeconds = 60;
  members.number("reveal", rules.reveal, 0.05, kMaxSeconds);
  members.number("slowdown", rules.slowdown, 1, 10);
  members.number("show", rules.show, 0, kMaxSeconds);
  members.number("melt", rules.melt, 0.05, kMaxSeconds);
  members.number("explode", rules.explode, 0.05, kMaxSeconds);
  members.integer("looks", rules.looks, 1, 1000);
  members.integer("pair_points", rules.pair_points, 0, 1000000);
  members.integer("look_cost", rules.look_cost, 0, 1000000);
  members.integer("second_points", rules.second_points, 0, 1000000);
  return members.finish();
}

/// Reads a level. Returns an error or "".
std::string read_level(const JsonValue& json, const std::string& where, PairsLevel& level) {
  Members members(json, where);
  members.integer("columns", level.columns, 1, kMaxSide);
  members.integer("rows", level.rows, 1, kMaxSide);
  members.number("seconds", level.seconds, 0.1, 86400);
  members.integer("pairs", level.pairs, 0, kMaxSide * kMaxSide / 2);
  if (level.columns * level.rows % 2 != 0)
    members.fail("", fmt::format("{} x {} is an odd number of pieces", level.columns, level.rows));
  return members.finish();
}

/// Makes a model's name absolute, unless it is the name of a shape. Returns an error or "".
std::string resolve_file(std::string& name, const fs::path& folder, const std::string& where) {
  if (is_shape_name(name)) return "";
  const fs::path file = (folder / name).lexically_normal();
  std::error_code error;
  if (!fs::is_regular_file(file, error))
    return fmt::format("{}: neither a file nor a shape: \"{}\"", where, name);
  name = file.string();
  return "";
}

/// Reads an object: either an object of a scene, or the name of a file or shape. Returns an error
/// or "".
std::string read_object(const JsonValue& json, const fs::path& folder, const std::string& where,
                        PairsFile& file) {
  JsonValue object = json;
  if (json.is_object()) {
    if (json.contains("model") == json.contains("shape"))
      return where + ": needs either \"model\" or \"shape\"";
  } else if (json.is_string()) {
    const bool is_shape = is_shape_name(json.string);
    object = JsonValue{{is_shape ? "shape" : "model", json}};
  } else {
    return where + ": must be a string or an object";
  }
  const char* key = object.contains("model") ? "model" : "shape";
  if (!object[key].is_string()) return fmt::format("{}/{}: must be a string", where, key);
  std::string name = object[key].string;
  if (const std::string error = resolve_file(name, folder, where); !error.empty()) return error;
  object[key] = name;
  file.game.objects.push_back(object.get("name").is_string() ? object.get("name").string
                                                             : fs::path(name).stem().string());
  file.objects.push_back(std::move(object));
  return "";
}

/// Reads a game into `file`. Returns an error or "".
std::string read_game(const JsonValue& json, const fs::path& folder, PairsFile& file) {
  if (!json.is_object())
    return "must be an object {...} - a game begins like {\"objects\": [...], \"levels\": [...]}";
  Members members(json, "");
  std::string ignored, board;
  members.text("description", ignored);  // a known key, but not used
  members.seed("seed", file.game.seed);
  members.texts("moves", file.moves);
  members.text("board", board);
  members.text("piece_color", file.piece_color);
  // Read the settings of the scene.
  if (const JsonValue* scene = members.find("scene")) file.scene_settings = *scene;
  if (!file.scene_settings.is_null() && !file.scene_settings.is_object())
    members.fail("scene", "must be an object");
  for (const char* key : {"source", "target", "intermediate", "blend", "actors"})
    if (file.scene_settings.is_object() && file.scene_settings.contains(key))
      members.fail(std::string("scene/") + key, "belongs to the game - leave it out");
  // Read the rules, the objects, the levels and the board.
  if (const JsonValue* rules = members.find("rules"))
    if (const std::string error = read_rules(*rules, file.game.rules); !error.empty()) return error;
  const JsonValue* objects = members.find("objects");
  if (!objects || !objects->is_array()) return "/objects: must be a list";
  for (std::size_t i = 0; i < objects->size(); ++i)
    if (const std::string error =
            read_object(objects->items[i], folder, fmt::format("/objects/{}", i), file);
        !error.empty())
      return error;
  const JsonValue* levels = members.find("levels");
  if (!levels || !levels->is_array() || levels->empty() || levels->size() > kMaxLevels)
    return fmt::format("/levels: must be a list of 1 to {} levels", kMaxLevels);
  for (std::size_t i = 0; i < levels->size(); ++i) {
    const std::string where = fmt::format("/levels/{}", i);
    PairsLevel level;
    if (const std::string error = read_level(levels->items[i], where, level); !error.empty())
      return error;
    const auto pairs = static_cast<std::size_t>(level.columns * level.rows / 2);
    if (file.game.objects.size() < pairs)
      return fmt::format("{}: hides {} objects, and there are only {}", where, pairs,
                         file.game.objects.size());
    file.game.levels.push_back(level);
  }
  if (!board.empty()) {
    if (const std::string error = resolve_file(board, folder, "/board"); !error.empty())
      return error;
    file.board = board;
  }
  return members.finish();
}

}  // namespace

Result<PairsFile> load_pairs_game(const fs::path& path) {
  PM_TRY(const std::string text, read_file(path, /*limit=*/1u << 20));
  remember_input(path);
  const auto document = parse_json(path.string(), text);
  if (!document)
    return make_error(ErrorCode::kInput,
                      "{}: is not JSON - a game begins like "
                      "{{\"objects\": [...], \"levels\": [...]}}",
                      path.string());
  PairsFile file;
  const std::string error = read_game(document->root, fs::absolute(path).parent_path(), file);
  if (!error.empty()) return make_error(ErrorCode::kInput, "{}: {}", path.string(), error);
  return file;
}

Status apply_move(PairsPlay& play, const std::string& text) {
  std::string words = text;
  std::replace(words.begin(), words.end(), ',', ' ');
  std::istringstream stream(words);
  std::string first, second, extra;
  stream >> first >> second >> extra;
  const auto fail = [&] {
    return make_error(ErrorCode::kInput,
                      "\"{}\" is no move - write two places, as in \"a1 b2\", "
                      "or \"wait 2.5\"",
                      text);
  };
  if (second.empty() || !extra.empty()) return fail();
  if (first == "wait") {
    const auto seconds = parse_number(second);
    return seconds ? play.wait(*seconds) : Status(fail());
  }
  const PairsLevel& level = play.game().levels[static_cast<std::size_t>(play.level())];
  PM_TRY(const int a, parse_square(level, first));
  PM_TRY(const int b, parse_square(level, second));
  return play.pick(a, b);
}

}  // namespace polymorph
