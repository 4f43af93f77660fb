// Provenance of a frame: the scene, the files and the program that it was made from, as stored in
// its image header (docs/provenance.md).
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/input_recorder.h"
#include "base/result.h"
#include "scene/input_names.h"
#include "scene/scene.h"

namespace polymorph {

/// The image attribute that holds encode_provenance().
inline constexpr const char* kProvenanceAttribute = "polymorph/provenance";
/// Maximum length of an encoded provenance, in bytes.
inline constexpr std::size_t kMaxProvenance = 8000;
/// Name of the single entry into which all files may be joined.
inline constexpr const char* kAllFiles = "#";

/// A file that a frame was made from, or several whose names differ only in their digits.
struct InputFile {
  std::string name;  ///< relative (input_names.h); '#' stands for the digits of several files
  /// 64 hex digits. For several files: the hash of sha256sum's output, "HASH  NAME" per file.
  std::string sha256;
  int count = 1;  ///< number of files
};

struct Provenance {
  std::string version, program;  ///< program_version() and shared_identity()
  std::string scene;             ///< all settings, as JSON; empty if it was too large
  bool coarse = false;           ///< balls are fitted as for previews
  std::vector<InputFile> files;  ///< ascending by name
};

/// Names the files that were read. Returns them in ascending order of names.
std::vector<InputFile> name_files(std::span<const ReadFile> files, const InputNames& names);

/// Makes the provenance of a scene's frames from the files that were read. Its `scene` refers
/// to files by their names in `files` and has all settings except description, output.file and
/// output.png.
Provenance make_provenance(const Scene& scene, std::span<const ReadFile> files);

/// Encodes a provenance as one line of printable ASCII of at most kMaxProvenance bytes. To fit, it
/// joins files whose names differ only in digits, then all files; as a last resort it omits the
/// scene.
std::string encode_provenance(Provenance provenance);

/// Decodes a provenance from an untrusted source. Returns only file names that are relative and
/// stay below their folder. Errors (kInput): it is damaged, too large, of another format, or names
/// other files.
Result<Provenance> decode_provenance(std::string_view text);

/// Loads the scene of a provenance, with its files below `folder`; messages call the scene `name`.
/// Errors: those of load_scene_text(); kInput if the provenance has no scene.
Result<Scene> load_provenance_scene(const Provenance& provenance,
                                    const std::filesystem::path& folder, const std::string& name);

/// Compares the files that a frame was made from with the files that were read now. Returns one
/// line per difference: first those of the frame's files, then files that only this run read.
std::vector<std::string> compare_inputs(std::span<const InputFile> frame_files,
                                        std::span<const InputFile> read_files);

/// Identity of this build as image headers state it: program_identity() without the paths in it.
std::string shared_identity();

}  // namespace polymorph
