// Model loader for all file formats.
#pragma once

#include <filesystem>

#include "base/result.h"
#include "model/load/load_obj.h"

namespace polymorph {

/// Loads a model. A mesh in memory under this path (scene/memory_models.h) takes precedence; else
/// the suffix decides: .glb, .gltf, .ply, .stl, .fbx, .dae, .off and .3ds are read by Assimp, in
/// the program polymorph_assimp, which is started for this; everything else is Wavefront OBJ. The
/// output of Assimp is processed like an OBJ with an MTL (model/load/load_obj.h): checked, welded,
/// triangulated and oriented outward. Node transforms are applied, FBX is converted to metres with
/// y up; mesh names become labels; base colour, roughness, metallic and the base colour's texture
/// are kept, also embedded textures. Vertex colours without a texture become materials of faces.
/// Errors: kInput, also if the reader crashes or exceeds its limits (16 GiB; 3 s of processor time
/// plus a second per megabyte of file and per 20 MB of output); kResource if polymorph_assimp is
/// missing, or if the model, with its instances counted, takes more memory than the process may
/// (base/memory.h).
Result<LoadedModel> load_model(const std::filesystem::path& path,
                               const LoadObjSettings& settings = {});

/// Tests whether the name has the suffix of a model: .obj or one that Assimp reads.
bool is_model_file(const std::filesystem::path& path);

/// Tests whether the name has the suffix of another program's scene, such as .blend or .usdc. The
/// error of load_model() then says what to export.
bool is_unsupported_model(const std::filesystem::path& path);

/// Tests whether load_model() would start polymorph_assimp.
bool is_assimp_model(const std::filesystem::path& path);

}  // namespace polymorph
