// Provenance of a frame: the scene, the files and the program that it was made from, as its header
// carries them (docs/provenance.md).
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
/// Maximum length of that text.
inline constexpr std::size_t kMaxProvenance = 8000;
/// The name of the one entry that stands for all files where they are joined.
inline constexpr const char* kAllFiles = "#";

/// A file that a frame was made from, or several whose names differ in their digits alone.
struct InputFile {
  std::string name;  ///< relative (input_names.h); '#' stands for the digits of several
  /// 64 hex digits. Several files: the hash of the text of sha256sum, a line "HASH  NAME" per file.
  std::string sha256;
  int count = 1;
};

struct Provenance {
  std::string version, program;  ///< release, and program_identity() without folders
  std::string scene;             ///< all settings, as JSON; empty: it was too large
  bool coarse = false;           ///< balls as previews have them
  std::vector<InputFile> files;  ///< ascending by name
};

/// Names the files that were read; ascending by name.
std::vector<InputFile> name_files(std::span<const ReadFile> files, const InputNames& names);

/// Lists the program and the files that a scene was made from, named for the header. Its `scene`
/// has those names of files, and all settings but the description and the output's name.
Provenance make_provenance(const Scene& scene, std::span<const ReadFile> files);

/// Writes a provenance as one line of printable ASCII of at most kMaxProvenance bytes. Where it is
/// longer, files whose names differ in digits alone are joined, then all of them; then the scene is
/// left out.
std::string encode_provenance(Provenance provenance);

/// Reads a provenance from an untrusted source. All names of files, in the scene too, are relative
/// and stay below their folder. Errors (kInput): it is damaged, too large or of a newer kind.
Result<Provenance> decode_provenance(std::string_view text);

/// Loads the scene, with its files below `folder`; messages call it `name`. Errors: those of
/// load_scene_text(); kInput where it was left out.
Result<Scene> load_provenance_scene(const Provenance& provenance,
                                    const std::filesystem::path& folder, const std::string& name);

/// Compares the files that a frame was made from with those that were read now; one line for each
/// that differs.
std::vector<std::string> compare_inputs(std::span<const InputFile> frame_files,
                                        std::span<const InputFile> read_files);

/// The identity of this build as a header has it.
std::string shared_identity();

}  // namespace polymorph
