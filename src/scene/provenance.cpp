#include "scene/provenance.h"

#include <algorithm>
#include <map>

#include "base/json.h"
#include "base/packed_text.h"
#include "base/private_paths.h"
#include "base/program_identity.h"
#include "base/sha256.h"
#include "base/text.h"
#include "scene/load_scene.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

constexpr int kFormat = 1;                  // version of the JSON
constexpr std::size_t kMaxText = 4u << 20;  // bytes of unpacked JSON; 1000 objects take half

/// Calls `change` with the path of every file that the scene names.
template <class Change>
void for_each_path(Scene& scene, const Change& change) {
  const auto change_if_set = [&](fs::path& path) {
    if (!path.empty()) change(path);
  };
  change_if_set(scene.lights.environment);
  for (ActorSettings& actor : scene.actors)
    for_each_object(actor, [&](ObjectSettings& object) { change_if_set(object.model); });
}

bool is_coarse(const Scene& scene) {
  const std::vector<ChainObject> chain = chain_objects(scene);
  return std::any_of(chain.begin(), chain.end(),
                     [](const ChainObject& object) { return object.settings->spheres.coarse; });
}

/// Writes the scene as one line of JSON in which files have their names from `names`. Leaves out
/// description, output.file and output.png.
std::string canonical_scene(const Scene& scene, const InputNames& names) {
  Scene canonical = scene;
  canonical.description.clear();
  canonical.output = {};
  canonical.output.png_bits = scene.output.png_bits;
  canonical.output.color_space = scene.output.color_space;
  canonical.output.multipart = scene.output.multipart;
  // The names become paths below "/", relative to which scene_to_json() writes them.
  for_each_path(canonical, [&](fs::path& path) { path = fmt::format("/{}", names.name(path)); });
  const auto document = parse_json("scene", scene_to_json(canonical, "/"));
  PM_CHECK(document.ok());
  return format_json(document->root);
}

/// Replaces each run of digits by one '#'.
std::string without_digits(std::string_view name) {
  std::string pattern;
  for (const char c : name) {
    const bool digit = c >= '0' && c <= '9';
    if (!digit || !pattern.ends_with('#')) pattern += digit ? '#' : c;
  }
  return pattern;
}

void sort_by_name(std::vector<InputFile>& files) {
  std::sort(files.begin(), files.end(),
            [](const InputFile& a, const InputFile& b) { return a.name < b.name; });
}

enum class Joining {
  kNone,      ///< one entry per file
  kNumbered,  ///< one entry per group of files whose names differ only in digits
  kAll        ///< one entry for all files
};

/// Joins the entries of files. A joined entry is named by the common pattern or kAllFiles.
std::vector<InputFile> join_files(std::span<const InputFile> files, Joining joining) {
  if (joining == Joining::kNone) return {files.begin(), files.end()};
  std::map<std::string, std::vector<InputFile>> groups;
  for (const InputFile& file : files)
    groups[joining == Joining::kAll ? kAllFiles : without_digits(file.name)].push_back(file);
  std::vector<InputFile> joined;
  for (const auto& [name, group] : groups) {
    if (group.size() == 1 && joining == Joining::kNumbered) {
      joined.push_back(group.front());
      continue;
    }
    Sha256 sha;
    for (const InputFile& file : group) {
      const std::string line = fmt::format("{}  {}\n", file.sha256, file.name);
      sha.add(line.data(), line.size());
    }
    joined.push_back({name, sha.hex(), static_cast<int>(group.size())});
  }
  sort_by_name(joined);
  return joined;
}

/// Finds out how the entries of a header were joined.
Joining find_joining(std::span<const InputFile> files) {
  if (files.size() == 1 && files.front().name == kAllFiles) return Joining::kAll;
  const bool joined =
      std::any_of(files.begin(), files.end(), [](const InputFile& file) { return file.count > 1; });
  return joined ? Joining::kNumbered : Joining::kNone;
}

/// Writes the provenance as JSON.
std::string write_provenance(const Provenance& provenance) {
  JsonValue files = JsonValue::object();
  for (const InputFile& file : provenance.files) {
    if (file.count == 1 && file.name != kAllFiles)
      files[file.name] = file.sha256;
    else
      files[file.name] = JsonValue{{"count", file.count}, {"sha256", file.sha256}};
  }
  JsonValue json{{"format", kFormat},
                 {"version", provenance.version},
                 {"program", provenance.program},
                 {"files", files}};
  if (provenance.coarse) json["coarse"] = true;
  // Append the text of the scene, which is JSON already, before the closing brace.
  std::string text = format_json(json);
  text.pop_back();
  return text + (provenance.scene.empty() ? "}" : ",\"scene\":" + provenance.scene + "}");
}

Error refuse(const std::string& why) {
  return make_error(ErrorCode::kInput, "the provenance in the header cannot be used: {}", why);
}

bool is_sha256(std::string_view text) {
  return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

Result<InputFile> read_file_entry(const JsonMember& member) {
  InputFile file;
  file.name = member.key;
  if (!is_safe_name(file.name))
    return refuse(fmt::format("\"{}\" is no name of a file below a folder", printable(file.name)));
  const JsonValue& digest = member.value.is_object() ? member.value.get("sha256") : member.value;
  if (member.value.is_object()) {
    const JsonValue& count = member.value.get("count");
    if (!count.integral || count.integer < 1 || count.integer > 10'000'000)
      return refuse(fmt::format("\"{}\" has no number of files", file.name));
    file.count = static_cast<int>(count.integer);
  }
  if (!digest.is_string() || !is_sha256(digest.string))
    return refuse(fmt::format("\"{}\" has no SHA-256", file.name));
  file.sha256 = digest.string;
  return file;
}

/// Finds the first path in a scene's JSON that does not stay below its folder. Returns it followed
/// by a space, so that even an empty path gives a result; "" if there is none. `key`: the key of
/// `value`. Where an object is expected, a string is a path, too.
std::string find_unsafe_path(const JsonValue& value, std::string_view key = {}) {
  if (key == "labels") return "";  // its strings are no paths
  const bool is_path = key == "model" || key == "environment" || key == "source" ||
                       key == "target" || key == "intermediate" || key == "blend";
  if (value.is_string())
    return is_path && !is_safe_name(value.string) ? printable(value.string) + " " : "";
  for (const JsonValue& item : value.items)
    if (std::string found = find_unsafe_path(item, key); !found.empty()) return found;
  for (const JsonMember& member : value.members)
    if (std::string found = find_unsafe_path(member.value, member.key); !found.empty())
      return found;
  return "";
}

}  // namespace

std::string shared_identity() { return remove_folders(program_identity()); }

std::vector<InputFile> name_files(std::span<const ReadFile> files, const InputNames& names) {
  std::vector<InputFile> named;
  for (const ReadFile& file : files) named.push_back({names.name(file.path), file.sha256});
  sort_by_name(named);
  return named;
}

Provenance make_provenance(const Scene& scene, std::span<const ReadFile> files) {
  std::error_code ignored;
  std::vector<fs::path> paths;
  for (const ReadFile& file : files) paths.push_back(file.path);
  const InputNames names =
      choose_names(fs::absolute(scene.path, ignored).lexically_normal().parent_path(), paths);
  Provenance provenance;
  provenance.version = program_version();
  provenance.program = shared_identity();
  provenance.coarse = is_coarse(scene);
  provenance.files = name_files(files, names);
  provenance.scene = canonical_scene(scene, names);
  return provenance;
}

std::string encode_provenance(Provenance provenance) {
  const std::vector<InputFile> files = provenance.files;
  std::string text;
  for (const Joining joining : {Joining::kNone, Joining::kNumbered, Joining::kAll}) {
    provenance.files = join_files(files, joining);
    text = pack_text(write_provenance(provenance));
    if (text.size() <= kMaxProvenance) return text;
  }
  provenance.scene.clear();
  return pack_text(write_provenance(provenance));
}

Result<Provenance> decode_provenance(std::string_view text) {
  // A generous bound: encode_provenance() writes at most kMaxProvenance bytes.
  if (text.size() > 8 * kMaxProvenance) return refuse("it is too long");
  auto unpacked = unpack_text(text, kMaxText);
  if (!unpacked) return refuse(unpacked.error().message);
  const auto document = parse_json("provenance", std::move(*unpacked));
  if (!document) return refuse(document.error().message);
  const JsonValue& root = document->root;
  const JsonValue &format = root.get("format"), &files = root.get("files"),
                  &scene = root.get("scene");
  if (!root.is_object() || !format.integral) return refuse("it does not say what it is");
  if (format.integer != kFormat)
    return refuse(fmt::format("it has format {}, and this version of polymorph knows {}",
                              format.integer, kFormat));
  if (!root.get("version").is_string() || !root.get("program").is_string() || !files.is_object())
    return refuse("it names no program or no files");
  if (!scene.is_null() && !scene.is_object()) return refuse("its scene is none");
  Provenance provenance;
  provenance.version = printable(root.get("version").string);
  provenance.program = printable(root.get("program").string);
  provenance.coarse = root.get("coarse").boolean;
  for (const JsonMember& member : files.members) {
    PM_TRY(InputFile file, read_file_entry(member));
    provenance.files.push_back(std::move(file));
  }
  sort_by_name(provenance.files);
  if (const std::string path = find_unsafe_path(scene); !path.empty())
    return refuse(fmt::format("its scene names {}, which is no file below a folder", path));
  if (scene.is_object()) provenance.scene = format_json(scene);
  return provenance;
}

Result<Scene> load_provenance_scene(const Provenance& provenance, const fs::path& folder,
                                    const std::string& name) {
  if (provenance.scene.empty())
    return refuse("the scene was too large for a header - render it from its own file");
  PM_TRY(Scene scene, load_scene_text(folder / name, provenance.scene));
  if (!provenance.coarse) return scene;
  for (ActorSettings& actor : scene.actors)
    for_each_object(actor, [&](ObjectSettings& object) {
      object.spheres.coarse = is_fitted(scene, object.spheres);
    });
  return scene;
}

std::vector<std::string> compare_inputs(std::span<const InputFile> frame_files,
                                        std::span<const InputFile> read_files) {
  std::map<std::string, InputFile> current;  // files that were read now, by name
  for (const InputFile& file : join_files(read_files, find_joining(frame_files)))
    current[file.name] = file;
  std::vector<std::string> differences;
  for (const InputFile& file : frame_files) {
    const auto found = current.find(file.name);
    if (found == current.end())
      differences.push_back(fmt::format("{}: was read for the frame, and is not now", file.name));
    else if (found->second.count != file.count)
      differences.push_back(
          fmt::format("{}: {} file{} now, and {} for the frame", file.name, found->second.count,
                      found->second.count == 1 ? " is read" : "s are read", file.count));
    else if (found->second.sha256 != file.sha256)
      differences.push_back(fmt::format("{}: {} SHA-256 {} now, and the frame was made from {}",
                                        file.name,
                                        file.count == 1 ? "has" : "together these files have",
                                        found->second.sha256, file.sha256));
    if (found != current.end()) current.erase(found);
  }
  for (const auto& [name, file] : current)
    differences.push_back(fmt::format("{}: is read now, and was not for the frame", name));
  return differences;
}

}  // namespace polymorph
