// A model from a file of any format that can be read.
#pragma once

#include <filesystem>

#include "base/result.h"
#include "model/load/load_obj.h"

namespace polymorph {

/// By the name's suffix: .glb, .gltf, .ply, .stl, .fbx, .dae, .off and .3ds are read by Assimp, in
/// the program polymorph_assimp, which is started for it; everything else is Wavefront OBJ. What
/// Assimp gives is taken as if it were an OBJ with an MTL (model/load/load_obj.h): checked, welded,
/// cut into triangles, made to look outward. Transforms of nodes are applied, FBX is brought to
/// metres and y up; names of meshes are labels; base colour, roughness, metallic and the base
/// colour's texture come along, embedded ones too. Colours of points, where there is no texture,
/// become materials of faces. Errors: kInput, also where the reader crashes, takes more than 16
/// GiB, or more than 10 s and a second per megabyte; kResource, where polymorph_assimp is not
/// there.
Result<LoadedModel> load_model(const std::filesystem::path& path,
                               const LoadObjSettings& settings = {});

/// Whether the name's suffix is that of a model: .obj or one that Assimp reads.
bool is_model_file(const std::filesystem::path& path);

/// Whether load_model() would start the reader.
bool is_foreign_model(const std::filesystem::path& path);

}  // namespace polymorph
