// Models of other formats than OBJ: what comes out of them, and what becomes of broken ones.
#include <cstring>

#include "testing/program.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

const fs::path kModels = source_dir() / "tests/data/models";

class ForeignModel : public ProgramTest {
 protected:
  nlohmann::json info(const fs::path& model) {
    return parse(run(0, {"info", model.string(), "--json"}).out);
  }
  /// "2 4 1" of a box.
  std::string size_of(const std::string& suffix) {
    const auto json = info(kModels / ("box" + suffix));
    EXPECT_EQ(json["closed"], true) << suffix;
    std::string text;
    for (int axis = 0; axis < 3; ++axis) text += fmt_of(json["size"][axis]) + " ";
    return text;
  }
  static std::string fmt_of(double value) {
    char text[40];
    std::snprintf(text, sizeof text, "%.4g", value);
    return text;
  }
};

/// The same box of 2 x 4 x 1, z up, in each format: those that say which axis is up are turned.
TEST_F(ForeignModel, TransformsAndAxesAreApplied) {
  for (const char* turned : {".glb", ".fbx", ".dae", ".3ds"})
    EXPECT_EQ(size_of(turned), "2 1 4 ") << turned;
  for (const char* as_it_is : {".ply", ".stl", ".off"})
    EXPECT_EQ(size_of(as_it_is), "2 4 1 ") << as_it_is;
}

TEST_F(ForeignModel, MaterialsAndEmbeddedTexturesComeAlong) {
  for (const char* suffix : {".glb", ".fbx"}) {
    const auto scene = R"({"source": {"model": ")" + (kModels / "box").string() + suffix +
                       R"("}, "target": "sphere", "frames": {"count": 4}, "spheres": {"balls": 12},
                         "surface": {"resolution": 16}})";
    write("scene.json", scene);
    const Ran ran = run(0, {"mesh", "scene.json", "-f", "1", "-o", "m.glb", "--overwrite"});
    EXPECT_EQ(ran.err.find("warning"), std::string::npos) << ran.err;
    const std::string glb = read_text(folder / "m.glb");
    std::uint32_t length = 0;
    std::memcpy(&length, glb.data() + 12, 4);
    const auto json = parse(glb.substr(20, length));
    ASSERT_EQ(json["materials"].size(), 1u) << suffix;
    const auto& material = json["materials"][0];
    EXPECT_EQ(material["name"], "paint");
    const auto& pbr = material["pbrMetallicRoughness"];
    EXPECT_EQ(json["images"].size(), 1u) << suffix;
    if (std::string(suffix) != ".glb") continue;
    EXPECT_NEAR(pbr["roughnessFactor"].get<double>(), 0.25, 1e-6);
    EXPECT_NEAR(pbr["metallicFactor"].get<double>(), 0.75, 1e-6);
  }
}

TEST_F(ForeignModel, ColoursOfPointsBecomeMaterials) {
  write("scene.json", R"({"source": {"model": ")" + (kModels / "box.ply").string() +
                          R"(", "up": "z"}, "target": "sphere", "frames": {"count": 4},
                            "spheres": {"balls": 12}, "surface": {"resolution": 16}})");
  run(0, {"mesh", "scene.json", "-f", "1", "-o", "m.obj"});
  const std::string mtl = read_text(folder / "m.mtl");
  EXPECT_TRUE(contains(mtl, "newmtl color_ff0000\nKd 1 0 0")) << mtl;
  EXPECT_TRUE(contains(mtl, "newmtl color_00ff00\n")) << mtl;
  // Upright now: the red half is on top.
  const auto json = info("m.obj");
  EXPECT_NEAR(json["size"][1].get<double>() / json["size"][2].get<double>(), 0.25, 1e-5);
}

TEST_F(ForeignModel, ScenesOfOtherProgramsAreToldWhatToExport) {
  for (const char* name : {"a.usdc", "b.BLEND"}) {
    write(name, "PXR-USDC");
    const Ran ran = run(3, {"info", name});
    EXPECT_TRUE(contains(ran.err, "files are not read - export the model as glTF (.glb)"))
        << ran.err;
    write("scene.json", std::string(R"({"source": ")") + name + R"(", "target": "sphere"})");
    EXPECT_TRUE(contains(run(1, {"check", "scene.json"}).err, "export the model as glTF"));
  }
}

TEST_F(ForeignModel, ReaderThatIsNotThere) {
  variables.emplace_back("POLYMORPH_ASSIMP", "/nowhere/reader");
  const Ran ran = run(5, {"info", (kModels / "box.glb").string()});
  EXPECT_TRUE(contains(ran.err, "cannot find the model reader")) << ran.err;
  variables.back().second = "/bin/true";
  EXPECT_TRUE(contains(run(3, {"info", (kModels / "box.glb").string()}).err, "stopped half way"));
}

TEST_F(ForeignModel, WhatLiesOutsideTheFolderIsNotRead) {
  write("secret.bin", std::string(96, '\0'));
  write("in/m.gltf",
        R"({"asset": {"version": "2.0"}, "buffers": [{"uri": "../secret.bin", "byteLength": 96}],
            "bufferViews": [{"buffer": 0, "byteLength": 96}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}], "scene": 0})");
  const Ran ran = run(3, {"info", "in/m.gltf"});
  EXPECT_TRUE(contains(ran.err, "in/m.gltf: cannot be read")) << ran.err;
}

TEST_F(ForeignModel, WhatAGltfFileAsksForInVainIsSaid) {
  const auto gltf = [](const std::string& more, const std::string& material) {
    return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
      "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
      "materials": [{"name": "lamp")" +
           material + R"(}], "buffers": [{"byteLength": 80, "uri": "points.bin"}],
      "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24},
        {"buffer": 0, "byteOffset": 72, "byteLength": 8}, {"buffer": 0, "byteLength": 24}],
      "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
        {"bufferView": 2, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1]},
        {"bufferView": 3, "componentType": 5126, "count": 2, "type": "VEC3"}])" +
           more + "}";
  };
  const float points[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const std::uint16_t corners[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  const float times[2] = {1, 0};  // keys that cannot be read
  std::string bytes(80, '\0');
  std::memcpy(bytes.data(), points, 48);
  std::memcpy(bytes.data() + 48, corners, 24);
  std::memcpy(bytes.data() + 72, times, 8);
  write("points.bin", bytes);
  write("plain.gltf", gltf(R"(, "extensionsRequired": ["KHR_materials_unlit"])", ""));
  EXPECT_EQ(run(0, {"info", "plain.gltf"}).err, "");
  write("lamp.gltf", gltf(R"(, "extensionsRequired": ["EXT_mesh_gpu_instancing"])",
                          R"(, "emissiveFactor": [1, 1, 0], "alphaMode": "BLEND")"));
  const std::string warnings = run(0, {"info", "lamp.gltf"}).err;
  for (const char* warning : {"it requires EXT_mesh_gpu_instancing, which is not supported",
                              "material lamp emits light, which is ignored",
                              "material lamp is transparent in part, which is ignored"})
    EXPECT_TRUE(contains(warnings, warning)) << warnings;
  // Of a model at rest no keys are read.
  write("keys.gltf", gltf(R"(, "animations": [{"samplers": [{"input": 2, "output": 3}], "channels":
          [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]}])",
                          ""));
  EXPECT_FALSE(contains(run(0, {"info", "keys.gltf"}).err, "keys of"));
  EXPECT_TRUE(
      contains(run(0, {"info", "keys@0001.gltf"}).err, "keys of \"translation\" of node 0"));
}

TEST_F(ForeignModel, AHeaderThatCountsTooMuchIsSaidSo) {
  write("much.ply",
        "ply\nformat binary_little_endian 1.0\nelement vertex 2147483648\nproperty float x\n"
        "property float y\nproperty float z\nelement face 1\n"
        "property list uint int vertex_indices\nend_header\n" +
            std::string(64, '\1'));
  const Ran ran = run(3, {"info", "much.ply"});
  EXPECT_TRUE(contains(ran.err, "much.ply: cannot be read: it asks for more memory than there is"))
      << ran.err;
}

// Assimp takes a line feed at the beginning of the data for a part of the header.
TEST_F(ForeignModel, PlyDataMayBeginWithAnyByte) {
  const auto bytes_of = [](auto value) {
    std::string bytes(sizeof value, '\0');
    std::memcpy(bytes.data(), &value, sizeof value);
    return bytes;
  };
  for (const std::string line_end : {"\n", "\r\n"}) {
    for (const char first : {'\n', '\r', ' ', 'a'}) {
      float corner = -1;
      std::memcpy(&corner, &first, 1);
      const float points[4][3] = {{corner, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 0, 2}};
      const int faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
      std::string text;
      for (const char* row :
           {"ply", "format binary_little_endian 1.0", "comment a tetrahedron", "element vertex 4",
            "property float x", "property float y", "property float z", "element face 4",
            "property list uchar int vertex_indices", "end_header"})
        text += row + line_end;
      for (const auto& point : points)
        for (const float number : point) text += bytes_of(number);
      for (const auto& face : faces) {
        text += '\3';
        for (const int index : face) text += bytes_of(index);
      }
      write("a.ply", text);
      const auto json = info("a.ply");
      EXPECT_EQ(json["points"], 4) << static_cast<int>(first);
      EXPECT_NEAR(json["volume"].get<double>(), (2.0 - static_cast<double>(corner)) * 4 / 6, 1e-5);
    }
  }
}

TEST_F(ForeignModel, BrokenOnesAreRefusedOrRead) {
  if (std::system("command -v python3 > /dev/null") != 0) GTEST_SKIP() << "no python3";
  const std::string make =
      "python3 " + (kModels / "make_broken.py").string() + " " + (folder / "broken").string();
  ASSERT_EQ(std::system(make.c_str()), 0);
  std::size_t refused = 0, all = 0;
  for (const auto& entry : fs::directory_iterator(folder / "broken")) {
    const Ran ran = finish_within(start({"info", entry.path().string()}), 60);
    EXPECT_TRUE(ran.code == 0 || ran.code == 3) << entry.path() << " " << ran.code << ran.err;
    if (ran.code == 3) {
      EXPECT_TRUE(contains(ran.err, "error: ")) << entry.path();
    }
    refused += ran.code == 3;
    ++all;
  }
  EXPECT_EQ(all, 7 * 27u);
  EXPECT_GT(refused, all / 2) << "of " << all;
}

}  // namespace
}  // namespace polymorph
