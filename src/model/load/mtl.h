// MTL materials: parsed by tinyobjloader after a strict scan.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "base/result.h"
#include "model/load/obj_scan.h"
#include "model/model.h"

namespace polymorph {

/// One `newmtl`, mapped to Material (colours are taken as scene-linear without conversion):
/// Kd -> color; Ns -> roughness = sqrt(2 / (Ns + 2)) (Walter et al. 2007, Phong exponent to
/// Beckmann width); Ks -> specular, at most 0.2 for non-metals (Phong files use it as a highlight's
/// strength, not as a reflectance); Pr, Pm -> roughness, metallic (PBR extension), which take
/// precedence over Ns; map_Kd -> texture, with its -s and -o options. Values outside [0, 1] are
/// clamped.
struct MtlMaterial {
  Material material;
  std::string texture;  ///< map_Kd as written, without its options; empty = none
  Vec2 uv_scale{1, 1}, uv_offset;
  std::string file;  ///< the MTL that defines it
  std::uint32_t texture_line = 0;
};

struct MtlSet {
  /// Materials of all files, in order; of equal names the first is used.
  std::vector<MtlMaterial> materials;
  std::vector<std::string> warnings;
};

/// Finds the material of a set that a usemtl name refers to. The set must outlive the MtlNames.
class MtlNames {
 public:
  explicit MtlNames(const MtlSet& set);
  const MtlMaterial* find(const std::string& name) const;  ///< null if there is none

 private:
  std::unordered_map<std::string_view, const MtlMaterial*> by_name_;
};

/// Parses the text of one MTL. Errors (kInput): not text, bad numbers, newmtl without a name; up to
/// 20 at once.
Result<MtlSet> parse_mtl(std::string_view bytes, const std::string& file);

inline constexpr std::size_t kMaxLibraries = 1000;
/// Loads all files of the OBJ's mtllib lines. A missing file is a warning, or an error when
/// `strict`. Errors (kInput): more than kMaxLibraries names.
Result<MtlSet> load_mtls(const std::filesystem::path& obj, const std::vector<NamedLine>& libraries,
                         bool strict);

}  // namespace polymorph
