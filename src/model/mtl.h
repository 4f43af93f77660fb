// MTL files -> materials. Parsed by tinyobjloader behind a strict scan of our own.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "model/model.h"
#include "model/obj_scan.h"

namespace polymorph {

/// One `newmtl`, mapped to our Material (colours are taken as scene-linear, as they stand):
///   Kd -> color; Ns -> roughness = sqrt(2 / (Ns + 2)) (Walter et al. 2007, Phong exponent to
///   Beckmann width); Ks -> specular, at most 0.2 for non-metals (Phong files use it as a
///   highlight's strength, not as a reflectance); Pr, Pm -> roughness, metallic (PBR extension),
///   which win over Ns. map_Kd -> texture, with its -s and -o options. Values outside [0, 1] are
///   clamped.
struct MtlMaterial {
  Material material;
  std::string texture;  ///< map_Kd as written, without its options; empty = none
  Vec2 uv_scale{1, 1}, uv_offset;
  std::string file;  ///< the MTL it stands in
  std::uint32_t texture_line = 0;
};

struct MtlSet {
  std::vector<MtlMaterial> materials;  ///< of all files, in order; the first of equal names counts
  std::vector<std::string> warnings;
};

/// One MTL's text. Errors (kInput): not text, bad numbers, newmtl without a name; up to 20 at once.
Result<MtlSet> parse_mtl(std::string_view bytes, const std::string& file);

/// All files of the OBJ's mtllib lines. A missing one is a warning, an error when `strict`.
Result<MtlSet> load_mtls(const std::filesystem::path& obj, const std::vector<NamedLine>& libraries,
                         bool strict);

}  // namespace polymorph
