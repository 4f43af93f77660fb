#include "compare/golden.h"

#include <algorithm>

#include "base/file.h"
#include "base/json.h"
#include "base/odd_names.h"
#include "base/text.h"
#include "compare/format_error.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// Throws a FormatError.
template <class... Args>
[[noreturn]] void fail(fmt::format_string<Args...> text, Args&&... args) {
  throw FormatError(fmt::format(text, std::forward<Args>(args)...));
}

/// Checks that `object` is an object with known keys. `where` names it in messages.
void check_keys(const JsonValue& object, const std::string& where,
                const std::vector<std::string>& known) {
  if (!object.is_object()) fail("{} must be an object", where);
  for (const auto& [key, value, offset] : object.members) {
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    const auto nearest = nearest_word(key, known);
    if (nearest) fail("{} has an unknown key '{}' - did you mean '{}'?", where, key, *nearest);
    fail("{} has an unknown key '{}' - known are {}", where, key, join_quoted(known));
  }
}

/// A limit that tolerance.json or suite.json may state.
struct Limit {
  const char* name;
  float Tolerance::*value;
  double end;  ///< limits must be below this value, which hardly any difference exceeds
};
constexpr Limit kLimits[] = {{"fail", &Tolerance::fail, 1},
                             {"relative", &Tolerance::relative, 1},
                             {"fail_percent", &Tolerance::fail_percent, 100},
                             {"hard_fail", &Tolerance::hard_fail, 1e30},
                             {"depth", &Tolerance::depth, 1},
                             {"normal", &Tolerance::normal, 2},
                             {"flip_mean", &Tolerance::flip_mean, 1},
                             {"flip_p99", &Tolerance::flip_p99, 1},
                             {"warn", &Tolerance::warn, 1e30},
                             {"warn_percent", &Tolerance::warn_percent, 100}};

std::vector<std::string> limit_names(const char* extra = nullptr) {
  std::vector<std::string> names;
  for (const Limit& limit : kLimits) names.emplace_back(limit.name);
  if (extra) names.emplace_back(extra);
  return names;
}

/// Parses a number in [0, end). `where` names it in messages.
double parse_number_below(const JsonValue& value, const std::string& where, double end) {
  if (!value.is_number()) fail("{} must be a number", where);
  const double number = value.number;
  if (!(number >= 0)) fail("{} must be a number of at least 0", where);
  if (!(number < end)) fail("{} must be below {:g} - nothing would fail", where, end);
  return number;
}

float parse_limit(const JsonValue& value, const std::string& where, const Limit& limit) {
  const auto number = static_cast<float>(parse_number_below(value, where, limit.end));
  // Rounding to float may have reached `end`.
  if (!(static_cast<double>(number) < limit.end))
    fail("{} must be below {:g} - nothing would fail", where, limit.end);
  return number;
}

/// Parses the "why" of an object, which must not be blank.
std::string parse_reason(const JsonValue& object, const std::string& where) {
  const std::string& reason = object.get("why").string;
  if (reason.find_first_not_of(" \t\r\n") == std::string::npos)
    fail("{} gives no reason - add \"why\": \"...\"", where);
  return reason;
}

/// Parses tolerance.json, where each limit is an object with its value and its reason.
Tolerance parse_limits(const JsonValue& object, Tolerance tolerance) {
  check_keys(object, "the file", limit_names());
  for (const Limit& limit : kLimits) {
    const JsonValue* entry = object.find(limit.name);
    if (!entry) continue;
    const std::string where = fmt::format("'{}'", limit.name);
    check_keys(*entry, where, {"value", "why"});
    if (!entry->contains("value")) fail("{} has no 'value'", where);
    tolerance.*limit.value = parse_limit(entry->get("value"), where + ": 'value'", limit);
    tolerance.why += fmt::format("{}{}: {}", tolerance.why.empty() ? "" : "; ", limit.name,
                                 parse_reason(*entry, where));
  }
  return tolerance;
}

/// Parses "tolerance" in suite.json: numbers, and one reason for all.
Tolerance parse_inline_limits(const JsonValue& object, Tolerance tolerance) {
  check_keys(object, "'tolerance'", limit_names("why"));
  for (const Limit& limit : kLimits)
    if (const JsonValue* value = object.find(limit.name))
      tolerance.*limit.value =
          parse_limit(*value, fmt::format("'tolerance': '{}'", limit.name), limit);
  tolerance.why = parse_reason(object, "'tolerance'");
  return tolerance;
}

/// Tests for the name of a file in the suite's own folder, rather than a path out of it.
bool is_own_file(const std::string& name) {
  return !name.empty() && name[0] != '.' && fs::path(name).filename() == name;
}

/// Parses "masks" of suite.json; `folder` is the suite's folder.
std::vector<GoldenMask> parse_masks(const JsonValue& list, const fs::path& folder) {
  if (!list.is_array()) fail("'masks' must be a list");
  std::vector<GoldenMask> masks;
  for (const JsonValue& entry : list.items) {
    check_keys(entry, "an entry of 'masks'", {"file", "ids", "why"});
    if (entry.contains("file") == entry.contains("ids"))
      fail("an entry of 'masks' needs either 'file' or 'ids'");
    GoldenMask mask;
    mask.why = parse_reason(entry, "an entry of 'masks'");
    if (entry.contains("file")) {
      if (!is_own_file(entry.get("file").string))
        fail("'masks': 'file' must be the name of a picture in this folder");
      mask.file = folder / entry.get("file").string;
    } else {
      const JsonValue& ids = entry.get("ids");
      if (!ids.is_array() || ids.empty()) fail("'masks': 'ids' must be a list");
      for (const JsonValue& id : ids.items) {
        if (!id.integral) fail("'masks': 'ids' must hold whole numbers");
        mask.ids.push_back(static_cast<int>(id.integer));
      }
    }
    masks.push_back(std::move(mask));
  }
  return masks;
}

/// Parses the percentage of pixels that masks may cover, which a suite with masks must state.
double parse_max_masked(const JsonValue& json) {
  if (!json.contains("masks")) {
    if (json.contains("max_masked_percent"))
      fail("'max_masked_percent' is for suites with 'masks'");
    return 0;
  }
  if (!json.contains("max_masked_percent"))
    fail(
        "'max_masked_percent' is missing: the share of the pixels that 'masks' may cover, as in 5");
  return parse_number_below(json.get("max_masked_percent"), "'max_masked_percent'", 100);
}

/// Reads the scene, or the command of another program, that renders the frames.
void parse_source(const JsonValue& json, GoldenSuite& suite) {
  if (json.contains("scene") && json.contains("command"))
    fail("'scene' and 'command' are both given - a suite has one of them");
  if (json.contains("command")) {
    suite.command = json.get("command").string;
    if (suite.command.find("{out}") == std::string::npos)
      fail("'command' must be a shell command with {{out}} where the frame's file goes");
    if (!json.contains("format")) return;
    const std::vector<std::string> known{"exr", "png", "tif", "jpg", "hdr"};
    suite.format = json.get("format").string;
    if (std::find(known.begin(), known.end(), suite.format) == known.end())
      fail("'format' must be {}", join_quoted(known));
    return;
  }
  if (json.contains("format")) fail("'format' is for suites with a 'command'");
  if (!json.get("scene").is_string())
    fail("'scene' is missing: the scene file, relative to this folder");
  suite.scene = (suite.folder / json.get("scene").string).lexically_normal();
  suite.tolerance = zero_tolerance();
  suite.tolerance.why = "polymorph's frames are the same bits everywhere";
}

/// Parses "frames" of suite.json. Numbers have at most 7 digits.
std::vector<int> parse_frames(const JsonValue& frames) {
  if (!frames.is_array() || frames.empty())
    fail("'frames' must be a list of at least one frame number");
  std::vector<int> numbers;
  for (const JsonValue& frame : frames.items) {
    if (!frame.integral || frame.integer < 0 || frame.integer > 9999999)
      fail("'frames' must hold whole numbers of 0 to 9999999");
    if (!numbers.empty() && frame.integer <= numbers.back()) fail("'frames' must rise");
    numbers.push_back(static_cast<int>(frame.integer));
  }
  return numbers;
}

/// Parses `file` and calls use(json). Every error names the file.
template <class F>
Status use_json_file(const fs::path& file, const F& use) {
  PM_TRY(const std::string text, read_file(file, 1 << 20));  // at most 1 MiB
  PM_TRY(const JsonDocument document, parse_json(file.string(), text));
  try {
    use(document.root);
  } catch (const FormatError& e) {
    return make_error(ErrorCode::kInput, "{}: {}", file.string(), e.what());
  }
  return Ok{};
}

/// Makes the error of a name that no entry of `root` has; it suggests the nearest name.
Error unknown_suite(const fs::path& root, const std::string& name) {
  const auto names = list_golden_suites(root);
  if (!names) return names.error();
  const auto nearest = nearest_word(name, *names);
  const std::string hint = nearest          ? fmt::format("did you mean '{}'?", *nearest)
                           : names->empty() ? "there are none yet"
                                            : "there are " + join_quoted(*names);
  return make_error(ErrorCode::kInput, "{}: no golden suite '{}' - {}", root.string(), name, hint);
}

/// Checks that the suite's folder and its suite.json exist. The error says what is wrong with them.
Status check_suite_files(const fs::path& root, const std::string& name) {
  const fs::path folder = root / name, file = folder / "suite.json";
  std::error_code error, ignored;
  // A name denotes one folder below the root, never a path.
  const bool is_name =
      !name.empty() && name != "." && name != ".." && fs::path(name).filename() == name;
  if (!is_name || fs::symlink_status(folder, ignored).type() == fs::file_type::not_found)
    return unknown_suite(root, name);
  if (fs::status(file, error).type() == fs::file_type::regular) return Ok{};
  // Find out why there is no such file, and say what to do.
  const std::string rule =
      fmt::format("each entry of {} is a suite: fix it, or move it away", root.string());
  if (fs::exists(folder, ignored) && !fs::is_directory(folder, ignored))
    return make_error(ErrorCode::kInput, "{}: no folder with a suite.json - {}", folder.string(),
                      rule);
  const auto broken_link = [&](const fs::path& path) {
    return fs::is_symlink(fs::symlink_status(path, ignored)) && !fs::exists(path, ignored);
  };
  for (const fs::path& path : {folder, file})
    if (broken_link(path))
      return make_error(ErrorCode::kInput, "{}: a link that leads nowhere - {}", path.string(),
                        rule);
  if (error && error != std::errc::no_such_file_or_directory)
    return make_error(ErrorCode::kInput, "{}: cannot be read: {} - {}", file.string(),
                      error.message(), rule);
  return make_error(ErrorCode::kInput, "{}: no suite.json in it - {}", folder.string(), rule);
}

/// Tests for the name of a file that people or their programs put beside suites. Any other entry is
/// a suite, perhaps a broken one.
bool is_note(const std::string& name) {
  return name.starts_with(".") || name.starts_with("README") || name.starts_with("LICENSE") ||
         name.ends_with(".md") || name.ends_with(".txt");
}

}  // namespace

Result<GoldenSuite> load_golden_suite(const fs::path& root, const std::string& name) {
  GoldenSuite suite;
  suite.name = name;
  suite.folder = root / name;
  const fs::path file = suite.folder / "suite.json", limits = suite.folder / "tolerance.json";
  PM_TRY_STATUS(check_suite_files(root, name));
  std::error_code ignored;
  // A broken link is a file that cannot be read, rather than a suite without limits.
  const bool has_limits = fs::symlink_status(limits, ignored).type() != fs::file_type::not_found;
  PM_TRY_STATUS(use_json_file(file, [&](const JsonValue& json) {
    check_keys(
        json, "the file",
        {"scene", "command", "format", "frames", "tolerance", "masks", "max_masked_percent"});
    parse_source(json, suite);
    if (!json.contains("frames"))
      fail("'frames' is missing: the list of frames that have a golden");
    suite.frames = parse_frames(json.get("frames"));
    if (json.contains("masks")) suite.masks = parse_masks(json.get("masks"), suite.folder);
    suite.max_masked_percent = parse_max_masked(json);
    if (json.contains("tolerance") && has_limits)
      fail("'tolerance' is given here and in tolerance.json - remove one");
    if (json.contains("tolerance"))
      suite.tolerance = parse_inline_limits(json.get("tolerance"), suite.tolerance);
  }));
  if (has_limits)
    PM_TRY_STATUS(use_json_file(limits, [&](const JsonValue& json) {
      Tolerance defaults = suite.tolerance;
      defaults.why.clear();
      suite.tolerance = parse_limits(json, defaults);
    }));
  return suite;
}

Result<std::vector<std::string>> list_golden_suites(const fs::path& root) {
  std::error_code error;
  std::vector<std::string> names;
  for (fs::directory_iterator entry(root, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    std::error_code ignored;
    const bool is_file = entry->symlink_status(ignored).type() == fs::file_type::regular;
    if (!(is_file && is_note(name))) remember_name(names.emplace_back(name));
  }
  if (error)
    return make_error(ErrorCode::kInput,
                      "{}: cannot list the golden suites: {} - check --root, or make a suite: "
                      "polymorph golden new NAME SCENE -f 1,12,24",
                      root.string(), error.message());
  std::sort(names.begin(), names.end());
  return names;
}

std::string suite_json_text(const GoldenSuite& suite) {
  std::error_code error;
  const fs::path scene = fs::absolute(suite.scene, error).lexically_normal();
  const fs::path folder = fs::absolute(suite.folder, error).lexically_normal();
  const JsonValue json{{"scene", scene.lexically_relative(folder).generic_string()},
                       {"frames", suite.frames}};
  return format_json(json) + "\n";
}

fs::path golden_image_path(const GoldenSuite& suite, int frame) {
  return suite.folder / fmt::format("frame.{:04}.{}", frame, suite.format);
}

}  // namespace polymorph
