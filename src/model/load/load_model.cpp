#include "model/load/load_model.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <map>
#include <optional>
#include <span>

#include "base/file.h"
#include "base/memory.h"
#include "base/text.h"
#include "kernels/interruption.h"
#include "model/load/build_model.h"
#include "model/load/import_process.h"
#include "model/load/load_memory.h"
#include "model/load/obj_scan.h"
#include "model/load/textures.h"
#include "scene/animated_model.h"

extern char** environ;

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// Finds polymorph_assimp in the program's folder, else in ../LIBDIR/polymorph; POLYMORPH_ASSIMP
/// overrides both.
Result<fs::path> find_reader() {
  std::vector<fs::path> paths;
  std::error_code error;
  if (const char* chosen = std::getenv("POLYMORPH_ASSIMP"); chosen && *chosen) {
    paths = {chosen};
  } else {
    const fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
    paths = {folder / "polymorph_assimp"};
    for (const char* library : {"lib", "lib/x86_64-linux-gnu", "lib/aarch64-linux-gnu", "lib64"})
      paths.push_back(folder.parent_path() / library / "polymorph" / "polymorph_assimp");
  }
  std::string tried;
  for (const fs::path& path : paths) {
    if (fs::is_regular_file(path, error)) return path;
    tried += "\n  " + path.string();
  }
  return make_error(ErrorCode::kResource,
                    "cannot find the model reader polymorph_assimp - install it where the program "
                    "looks for it, or name it in POLYMORPH_ASSIMP; tried:{}",
                    tried);
}

/// Standard output of the reader, and its status as waitpid() gives it. `is_too_large`: the reader
/// was stopped because its output exceeded the limit.
struct ReaderRun {
  std::string bytes;
  int status = 0;
  bool is_too_large = false, is_interrupted = false;
};

/// A model's file, and the pose that its path names.
struct AnimatedPath {
  fs::path file;
  std::string pose;  ///< time in seconds, then indices of the active animations; empty: rest pose
};

AnimatedPath resolve_pose(const fs::path& path) {
  const auto pose = parse_pose_path(path);
  if (!pose) return {path, {}};
  const Animation animation = read_animation(pose->file, pose->animation);
  return {pose->file,
          fmt::format("{} {}", animation.seconds(pose->number), fmt::join(animation.playing, " "))};
}

/// Runs the reader until its output ends. `memory`: bytes that the reader and the model made of its
/// output may take; `limit`: maximum bytes of its output.
Result<ReaderRun> run_reader(const fs::path& reader, const AnimatedPath& model,
                             std::uint64_t memory, std::uint64_t limit) {
  // Start the reader with its standard output in a pipe.
  int pipe_ends[2];
  if (::pipe2(pipe_ends, O_CLOEXEC) != 0)
    return make_error(ErrorCode::kResource, "cannot make a pipe: {}", std::strerror(errno));
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, pipe_ends[1], 1);
  posix_spawn_file_actions_addopen(&actions, 2, "/dev/null", O_WRONLY, 0);
  std::string texts[4] = {reader.string(), model.file.string(), std::to_string(memory), model.pose};
  char* arguments[5] = {texts[0].data(), texts[1].data(), texts[2].data(),
                        model.pose.empty() ? nullptr : texts[3].data(), nullptr};
  pid_t id = 0;
  const int spawn_error = ::posix_spawn(&id, reader.c_str(), &actions, nullptr, arguments, environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(pipe_ends[1]);
  if (spawn_error != 0) {
    ::close(pipe_ends[0]);
    return make_error(ErrorCode::kResource, "{}: cannot be started: {}", reader.string(),
                      std::strerror(spawn_error));
  }
  // Read the pipe to its end, or until the limit or an interruption.
  ReaderRun run;
  std::string buffer(1 << 16, '\0');
  for (;;) {
    pollfd ready{pipe_ends[0], POLLIN, 0};
    constexpr int kMilliseconds = 50;  // time between tests for an interruption
    const int count = ::poll(&ready, 1, kMilliseconds);
    if (interruption_requested) {
      run.is_interrupted = true;
      ::kill(id, SIGKILL);
      break;
    }
    if (count == 0 || (count < 0 && errno == EINTR)) continue;
    const ssize_t n = ::read(pipe_ends[0], buffer.data(), buffer.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    run.bytes.append(buffer.data(), static_cast<std::size_t>(n));
    if (run.bytes.size() > limit) {
      run.is_too_large = true;
      ::kill(id, SIGKILL);
      break;
    }
  }
  ::close(pipe_ends[0]);
  while (::waitpid(id, &run.status, 0) < 0 && errno == EINTR) {
  }
  if (run.is_interrupted) throw Interrupted();
  return run;
}

/// Parsed output of the reader; `obj` and `mtl` are views of that output. `error` and `too_large`
/// are the messages of the records "error" and "large", or empty; `textures` are by name.
struct Imported {
  std::string_view obj, mtl;
  std::string error, too_large;
  std::map<std::string, std::string> textures;
  std::vector<std::string> warnings, inputs;
  bool is_complete = false;  ///< the "end" record was read
};

Imported parse(std::string_view bytes) {
  Imported imported;
  if (!bytes.starts_with(kImportHello)) return imported;
  bytes.remove_prefix(std::strlen(kImportHello));
  while (!bytes.empty()) {
    const std::size_t end = bytes.find('\n');
    if (end == std::string_view::npos) return imported;
    const std::vector<std::string> words = split(bytes.substr(0, end), ' ');
    bytes.remove_prefix(end + 1);
    if (words.size() != 3) return imported;
    const auto name_size = parse_integer(words[1]), size = parse_integer(words[2]);
    if (!name_size || !size || *name_size < 0 || *size < 0) return imported;
    const auto name_end = static_cast<std::size_t>(*name_size),
               record_end = name_end + static_cast<std::size_t>(*size);
    if (record_end > bytes.size()) return imported;
    const std::string name(bytes.substr(0, name_end));
    const std::string_view body = bytes.substr(name_end, record_end - name_end);
    bytes.remove_prefix(record_end);
    if (words[0] == "obj") imported.obj = body;
    if (words[0] == "mtl") imported.mtl = body;
    if (words[0] == "texture") imported.textures[name] = body;
    if (words[0] == "input") imported.inputs.push_back(name);
    if (words[0] == "warning") imported.warnings.push_back(name);
    if (words[0] == "error") imported.error = name;
    if (words[0] == "large") imported.too_large = name;
    if (words[0] == "end") imported.is_complete = true;
  }
  return imported;
}

/// Returns the first line of a message, safe to print.
std::string first_line(const std::string& text) {
  const std::string line = text.substr(0, text.find('\n'));
  return printable(line);
}

/// Removes line numbers after the file's name: they refer to the intermediate OBJ, which users
/// never see.
std::string remove_line_numbers(std::string text, const std::string& file) {
  for (std::size_t position = text.find(file + ":"); position != std::string::npos;
       position = text.find(file + ":", position + file.size())) {
    const std::size_t first = position + file.size();
    std::size_t end = first;
    while (end + 1 < text.size() && text[end] == ':' && text[end + 1] >= '0' &&
           text[end + 1] <= '9')
      for (++end; end < text.size() && text[end] >= '0' && text[end] <= '9';) ++end;
    text.erase(first, end - first);
  }
  return text;
}

Error make_reader_error(const std::string& file, const ReaderRun& run) {
  std::string reason = "its reader stopped half way";
  if (run.is_too_large) reason = "it unpacks to more than can be taken";
  if (WIFSIGNALED(run.status))
    reason = WTERMSIG(run.status) == SIGXCPU
                 ? "its reader does not come to an end"
                 : fmt::format("its reader crashed (signal {})", WTERMSIG(run.status));
  return make_error(ErrorCode::kInput, "{}: {} - export it anew, or as OBJ or glTF", file, reason);
}

std::string lower_suffix(const fs::path& path) { return lower_case(path.extension().string()); }

/// Suffixes of the formats that Assimp reads.
constexpr const char* kAssimpSuffixes[] = {".glb", ".gltf", ".ply", ".stl",
                                           ".fbx", ".dae",  ".off", ".3ds"};

/// Suffixes of scenes and CAD models of other programs, which cannot be read.
constexpr const char* kUnsupportedSuffixes[] = {
    ".blend", ".usd", ".usda", ".usdc", ".usdz", ".abc", ".ma",   ".mb",  ".max", ".c4d",
    ".ztl",   ".3dm", ".hip",  ".lwo",  ".step", ".stp", ".iges", ".igs", ".skp"};

bool is_one_of(std::span<const char* const> suffixes, const fs::path& path) {
  return std::find(suffixes.begin(), suffixes.end(), lower_suffix(path)) != suffixes.end();
}

Result<LoadedModel> run_and_parse(const fs::path& path, const LoadObjSettings& settings) {
  const std::string file = path.string();
  const AnimatedPath animated = resolve_pose(path);
  remember_input(animated.file);
  // Unreadable, too large and empty files are reported as for any other format.
  PM_TRY_STATUS([&]() -> Status {
    PM_TRY(const std::string bytes, read_file(animated.file, settings.max_bytes));
    if (bytes.empty()) return make_error(ErrorCode::kInput, "{}: is empty", file);
    return Ok{};
  }());
  PM_TRY(const fs::path reader, find_reader());
  const std::uint64_t available_memory = remaining_memory();
  // The OBJ text of a model is longer than a binary file, hence the factor 8.
  PM_TRY(ReaderRun run,
         run_reader(reader, animated, available_memory,
                    std::min<std::uint64_t>(8 * settings.max_bytes, available_memory)));
  const Imported imported = parse(run.bytes);
  for (const std::string& input : imported.inputs) remember_input(input);
  if (!imported.too_large.empty())
    return make_error(ErrorCode::kResource, "{}: {} - use a smaller model or raise --max-memory",
                      file, first_line(imported.too_large));
  if (!imported.error.empty())
    return make_error(ErrorCode::kInput, "{}: cannot be read: {}", file,
                      first_line(imported.error));
  if (!imported.is_complete || !WIFEXITED(run.status) || WEXITSTATUS(run.status) != 0)
    return make_reader_error(file, run);
  // Build the model as from an OBJ file.
  PM_TRY(ObjScan scan, scan_obj(imported.obj, file));
  PM_TRY(MtlSet mtls, parse_mtl(std::string(imported.mtl), file));
  run.bytes = {};  // frees the OBJ text, which is in `scan` now
  LoadedModel loaded;
  loaded.file_points = scan.point_count();
  for (const std::string& warning : imported.warnings)
    loaded.warnings.push_back(fmt::format("{}: {}", file, first_line(warning)));
  loaded.warnings.insert(loaded.warnings.end(), scan.warnings.begin(), scan.warnings.end());
  loaded.warnings.insert(loaded.warnings.end(), mtls.warnings.begin(), mtls.warnings.end());
  PM_TRY(loaded.model, build_model(scan, mtls, path, loaded.warnings,
                                   settings.vertices ? &loaded.vertices : nullptr));
  if (settings.textures)
    PM_TRY_STATUS(load_textures({path, scan, mtls, imported.textures}, settings.strict,
                                loaded.model, loaded.warnings));
  return loaded;
}

Result<LoadedModel> load_foreign(const fs::path& path, const LoadObjSettings& settings) {
  auto loaded = run_and_parse(path, settings);
  if (!loaded)
    return Error{loaded.error().code, remove_line_numbers(loaded.error().message, path.string())};
  for (std::string& warning : loaded->warnings)
    warning = remove_line_numbers(warning, path.string());
  return loaded;
}

}  // namespace

bool is_model_file(const fs::path& path) {
  return lower_suffix(path) == ".obj" || is_assimp_model(path);
}

bool is_assimp_model(const fs::path& path) { return is_one_of(kAssimpSuffixes, path); }

bool is_unsupported_model(const fs::path& path) { return is_one_of(kUnsupportedSuffixes, path); }

Result<LoadedModel> load_model(const fs::path& path, const LoadObjSettings& settings) {
  if (const auto mesh = find_memory_mesh(path)) return load_memory(*mesh, path, settings);
  if (is_unsupported_model(path))
    return make_error(ErrorCode::kInput,
                      "{}: {} files are not read - export the model as glTF (.glb), FBX or OBJ",
                      path.string(), lower_suffix(path));
  return is_assimp_model(path) ? load_foreign(path, settings) : load_obj(path, settings);
}

}  // namespace polymorph
