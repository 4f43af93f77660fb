// Files of whole sequences, glTF and OpenUSD, as what reads them finds them.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "interchange/surface_writer.h"
#include "testing/temporary_folder.h"
#include "testing/texture.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Two triangles: one of a plain material, one of another that has a texture.
SurfaceFrame square() {
  SurfaceFrame frame;
  frame.positions = {{-1, 0, 0}, {1, 0, 0}, {1, 3, 0}, {-1, 3, 0}};
  frame.triangles = {{{0, 1, 2}}, {{0, 2, 3}}};
  frame.normals.assign(4, {0, 0, 1});
  frame.velocities = {{1, 2, 3}, {0, 0, 0}, {0, 0, 0}, {4, 5, 6}};
  frame.colors.assign(4, {0.25f, 0.5f, 1});
  frame.labels = {0, 0, 1, 1};
  frame.corner_uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}};
  frame.triangle_materials = {0, 1};
  frame.materials.resize(2);
  frame.materials[0].name = "plain";
  frame.materials[0].roughness = 0.25f;
  frame.materials[0].transmission = 0.5f;
  frame.materials[1].name = "printed";
  Image texture = make_image(2, 1, {"R", "G", "B"});
  texture.pixels = {1, 0, 0, 0, 0, 1};
  frame.materials[1].texture = float_texture(std::move(texture));
  frame.mixture.name = "mixture";
  return frame;
}

SurfaceSequence sequence_of(int frames) {
  SurfaceSequence sequence;
  sequence.actors = {"it"};
  sequence.label_names = {{"head", "foot"}};
  sequence.last_frame = frames;
  sequence.cameras = {{{0, 0, 5}, {1, 0, 0}, {0, 1, 0}, {0, 0, -1}}};
  return sequence;
}

class Sequences : public FolderTest {
 protected:
  /// What is in the file of these frames, which are numbered from 1.
  std::string written(Result<std::unique_ptr<SurfaceWriter>> writer, const std::string& name,
                      const std::vector<SurfaceFrame>& frames) const {
    EXPECT_TRUE(writer.ok());
    for (std::size_t i = 0; i < frames.size(); ++i)
      EXPECT_TRUE((*writer)->add(static_cast<int>(i + 1), {&frames[i], 1}).ok());
    EXPECT_FALSE(fs::exists(folder / name)) << "whole or not at all";
    const Status finished = (*writer)->finish();
    EXPECT_TRUE(finished.ok()) << finished.error().message;
    return *read_file(folder / name);
  }

  struct Glb {
    json file;
    std::string bytes;
    /// Of an accessor, as its vertices are laid out.
    template <class T>
    T at(std::size_t accessor, std::size_t vertex, std::size_t stride) const {
      const json& view = file["bufferViews"][file["accessors"][accessor]["bufferView"].get<int>()];
      T value;
      std::memcpy(&value, bytes.data() + view["byteOffset"].get<std::size_t>() + vertex * stride,
                  sizeof value);
      return value;
    }
  };
  Glb glb(const std::vector<SurfaceFrame>& frames, bool quantize = false) const {
    GlbSettings settings;
    settings.quantize = quantize;
    const std::string all = written(
        make_glb_writer(folder / "m.glb", sequence_of(static_cast<int>(frames.size())), settings),
        "m.glb", frames);
    std::uint32_t head[5];
    std::memcpy(head, all.data(), sizeof head);
    EXPECT_EQ(head[2], all.size());
    return {json::parse(all.substr(20, head[3])), all.substr(28 + head[3])};
  }
  std::string usd(const std::vector<SurfaceFrame>& frames) const {
    return written(
        make_usd_writer(folder / "m.usda", sequence_of(static_cast<int>(frames.size())), true),
        "m.usda", frames);
  }
};

TEST_F(Sequences, GlbHasPointsMaterialsAndTextures) {
  const SurfaceFrame frame = square();
  const Glb file = glb({frame});
  ASSERT_EQ(file.file["meshes"].size(), 1u);
  const json primitives = file.file["meshes"][0]["primitives"];
  ASSERT_EQ(primitives.size(), 2u) << "one of each material";
  const json attributes = primitives[0]["attributes"];
  for (std::size_t v = 0; v < 4; ++v) {
    EXPECT_EQ(file.at<Vec3>(attributes["POSITION"], v, 12), frame.positions[v]);
    EXPECT_EQ(file.at<Vec3>(attributes["NORMAL"], v, 12), frame.normals[v]);
    EXPECT_EQ(file.at<Vec3>(attributes["_VELOCITY"], v, 12), frame.velocities[v]);
  }
  EXPECT_EQ(file.at<Vec2>(attributes["TEXCOORD_0"], 2, 8), (Vec2{1, 0})) << "v runs down there";
  EXPECT_FALSE(attributes.contains("COLOR_0")) << "materials say what it looks like";
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_EQ(file.at<std::uint16_t>(primitives[1]["indices"], i, 2), frame.triangles[1].v[i]);
  const json materials = file.file["materials"];
  EXPECT_EQ(materials[0]["pbrMetallicRoughness"]["roughnessFactor"], 0.25);
  EXPECT_EQ(materials[0]["extensions"]["KHR_materials_transmission"]["transmissionFactor"], 0.5);
  EXPECT_FALSE(materials[0]["pbrMetallicRoughness"].contains("baseColorTexture"));
  EXPECT_EQ(materials[1]["pbrMetallicRoughness"]["baseColorTexture"]["index"], 0);
  const json image = file.file["bufferViews"][file.file["images"][0]["bufferView"].get<int>()];
  EXPECT_EQ(file.bytes.substr(image["byteOffset"].get<std::size_t>() + 1, 3), "PNG");
}

TEST_F(Sequences, QuantizedPointsAreWithinAStepOfTheBox) {
  const SurfaceFrame frame = square();
  const Glb file = glb({frame}, true);
  const json attributes = file.file["meshes"][0]["primitives"][0]["attributes"];
  const json node = file.file["nodes"][0];
  const float scale = node["scale"][0],
              low[3] = {node["translation"][0], node["translation"][1], node["translation"][2]};
  for (std::size_t v = 0; v < 4; ++v) {
    const Vec3 p = frame.positions[v];
    const float own[3] = {p.x, p.y, p.z};
    const auto q = file.at<std::array<std::uint16_t, 3>>(attributes["POSITION"], v, 8);
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(low[k] + scale * static_cast<float>(q[k]) / 65535, own[k], scale / 65535);
    EXPECT_EQ((file.at<std::array<std::int8_t, 3>>(attributes["NORMAL"], v, 4)[2]), 127);
  }
  EXPECT_FALSE(attributes.contains("_VELOCITY"));
  EXPECT_EQ(file.file["extensionsRequired"][0], "KHR_mesh_quantization");
}

TEST_F(Sequences, FramesThatAreAlikeShareANodeAndOthersDoNot) {
  const SurfaceFrame still = square(), nothing;
  SurfaceFrame moved = still;
  moved.positions[0].x -= 1;
  const Glb file = glb({still, still, moved, nothing, still});
  EXPECT_EQ(file.file["meshes"].size(), 3u);
  // The first shows for two frames, and again nothing of it after that.
  const json& sampler = file.file["animations"][0]["samplers"][0];
  const float shown[][2] = {{0, 1}, {2 / 24.0f, 0}, {5 / 24.0f, 0}};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(file.at<float>(sampler["input"], i, 4), shown[i][0]);
    EXPECT_EQ(file.at<Vec3>(sampler["output"], i, 12).x, shown[i][1]);
  }
}

TEST_F(Sequences, AMaterialThatChangesIsAnotherNode) {
  const SurfaceFrame still = square();
  SurfaceFrame rougher = still, swapped = still, mixed = still, shinier = still;
  rougher.materials[0].roughness = 0.75f;
  swapped.triangle_materials = {1, 0};
  mixed.is_mixed = shinier.is_mixed = true;
  shinier.mixture.metallic = 1;
  const Glb file = glb({still, rougher, swapped, mixed, shinier});
  EXPECT_EQ(file.file["meshes"].size(), 5u);
  const json attributes = file.file["meshes"][3]["primitives"][0]["attributes"];
  EXPECT_EQ(file.at<Vec3>(attributes["COLOR_0"], 0, 12), (Vec3{0.25f, 0.5f, 1}));
  const auto last = file.file["meshes"][4]["primitives"][0]["material"].get<std::size_t>();
  EXPECT_EQ(file.file["materials"][last]["pbrMetallicRoughness"]["metallicFactor"], 1);
}

TEST_F(Sequences, UsdHasWhatChangesAtItsTime) {
  const SurfaceFrame still = square();
  SurfaceFrame moved = still;
  moved.positions[0] = {-2, 0.1f, 0};
  moved.triangle_materials = {0, 0};
  const std::string text = usd({still, still, moved});
  for (const char* part :
       {"endTimeCode = 3\n", "def Xform \"it\"", "def Mesh \"plain\"",
        "1: [(-1, 0, 0), (1, 0, 0), (1, 3, 0), (-1, 3, 0)]",
        "3: [(-2, 0.1, 0), (1, 0, 0), (1, 3, 0), (-1, 3, 0)]",
        "[(1, 2, 3), (0, 0, 0), (0, 0, 0), (4, 5, 6)]", "[0, 0, 1, 1]", "(0.25, 0.5, 1)",
        "asset inputs:file = @./m.texture1.png@", "def GeomSubset \"printed\""})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  EXPECT_EQ(read_file(folder / "m.texture1.png")->substr(1, 3), "PNG");
}

/// The lines of the prim that `head` begins, to the line that closes it.
std::string prim_of(const std::string& text, const std::string& head) {
  const std::size_t begin = text.find(head);
  if (begin == std::string::npos) return "";
  const std::size_t line = text.rfind('\n', begin) + 1;
  const std::string end = "\n" + text.substr(line, begin - line) + "}\n";
  return text.substr(begin, text.find(end, begin) - begin);
}

TEST_F(Sequences, UsdHasAMeshForEachLookAndShowsOneAtATime) {
  SurfaceFrame source = square(), mixed = square(), target = square();
  source.materials.resize(1), target.materials.erase(target.materials.begin());
  source.triangle_materials = target.triangle_materials = {0, 0};
  mixed.is_mixed = true;
  mixed.positions[0].x = -3;
  const std::string text = usd({source, mixed, mixed, target});
  const struct {
    const char *mesh, *material, *first, *shown, *last;
  } looks[] = {
      {"plain", "plain", "1: \"inherited\"", "2: \"invisible\"", "4: \"invisible\""},
      {"surface", "points_of_it", "1: \"invisible\"", "2: \"inherited\"", "4: \"invisible\""},
      {"printed", "printed", "1: \"invisible\"", "3: \"invisible\"", "4: \"inherited\""}};
  for (const auto& [mesh, material, first, shown, last] : looks) {
    const std::string prim = prim_of(text, std::string("def Mesh \"") + mesh + "\"");
    for (const char* part : {first, shown, last})
      EXPECT_NE(prim.find(part), std::string::npos) << mesh << ": " << part << "\n" << prim;
    // The assignment is the same in all frames: some programs read it once.
    EXPECT_NE(prim.find(std::string("</morph/materials/") + material + ">"), std::string::npos)
        << prim;
    EXPECT_EQ(prim.find("GeomSubset"), std::string::npos) << prim;
  }
  // Where it is not shown it has no points, for programs that do not know that it is invisible.
  EXPECT_NE(prim_of(text, "def Mesh \"plain\"").find("2: [],"), std::string::npos) << text;
}

/// Cameras that go round by 90 degrees about y in `frames` steps, and zoom.
SurfaceSequence turning(int frames) {
  SurfaceSequence sequence = sequence_of(frames);
  sequence.cameras.clear();
  for (int i = 0; i < frames; ++i) {
    const float angle = 1.5707963f * static_cast<float>(i) / static_cast<float>(frames - 1);
    const Vec3 out{std::sin(angle), 0, std::cos(angle)};
    sequence.cameras.push_back({out * 5.0f,
                                {out.z, 0, -out.x},
                                {0, 1, 0},
                                -out,
                                0.25f + 0.1f * static_cast<float>(i),
                                4.0f / 3,
                                5});
  }
  return sequence;
}

TEST_F(Sequences, UsdHasTheCameraOfEachFrame) {
  const std::string text = written(make_usd_writer(folder / "m.usda", turning(3), true), "m.usda",
                                   {square(), square(), square()});
  const std::string prim = prim_of(text, "def Camera \"camera\"");
  for (const char* part : {"float focalLength.timeSamples = {\n            1: 36,", "3: 20,",
                           "matrix4d xformOp:transform.timeSamples = {\n            1: ( (1, 0, ",
                           "float focusDistance = 5\n"})
    EXPECT_NE(prim.find(part), std::string::npos) << part << "\n" << prim;
  fs::remove(folder / "m.usda");
  const std::string still = prim_of(usd({square()}), "def Camera \"camera\"");
  EXPECT_EQ(still.find("timeSamples"), std::string::npos) << still;
}

TEST_F(Sequences, GlbHasTheCameraOfEachFrame) {
  const std::string all = written(make_glb_writer(folder / "m.glb", turning(3), {}), "m.glb",
                                  {square(), square(), square()});
  std::uint32_t size;
  std::memcpy(&size, all.data() + 12, sizeof size);
  const Glb file{json::parse(all.substr(20, size)), all.substr(28 + size)};
  const std::size_t node = file.file["nodes"].size() - 1;
  EXPECT_EQ(file.file["nodes"][node]["camera"], 0);
  EXPECT_FALSE(file.file["nodes"][node].contains("matrix")) << "a matrix cannot be animated";
  const json& animation = file.file["animations"][0];
  std::size_t found = 0;
  for (const json& channel : animation["channels"]) {
    const json& target = channel["target"];
    const json& sampler = animation["samplers"][channel["sampler"].get<std::size_t>()];
    const std::size_t output = sampler["output"];
    if (target["path"] == "pointer" &&
        target["extensions"]["KHR_animation_pointer"]["pointer"] == "/cameras/0/perspective/yfov") {
      ++found;
      EXPECT_NEAR(file.at<float>(output, 2, 4), 2 * std::atan(0.45f), 1e-6f);
    }
    if (target.value("node", json(0)) != node || target["path"] == "pointer") continue;
    ++found;
    EXPECT_EQ(sampler["interpolation"], "LINEAR");
    EXPECT_EQ(file.at<float>(sampler["input"], 2, 4), 2 / 24.0f);
    if (target["path"] == "translation") {
      EXPECT_EQ(file.at<Vec3>(output, 0, 12), (Vec3{0, 0, 5}));
    }
    if (target["path"] == "rotation") {  // 90 degrees about y
      const auto q = file.at<std::array<float, 4>>(output, 2, 16);
      EXPECT_NEAR(q[1], std::sqrt(0.5f), 1e-6f);
      EXPECT_NEAR(q[3], std::sqrt(0.5f), 1e-6f);
    }
  }
  EXPECT_EQ(found, 3u);
}

TEST_F(Sequences, UsdReplacesNoTextureUnlessTold) {
  ASSERT_TRUE(write_file(folder / "m.texture1.png", "mine").ok());
  auto writer = make_usd_writer(folder / "m.usda", sequence_of(1), false);
  ASSERT_TRUE(writer.ok());
  const SurfaceFrame frame = square();
  ASSERT_TRUE((*writer)->add(1, {&frame, 1}).ok());
  EXPECT_EQ((*writer)->finish().error().code, ErrorCode::kOutput);
  EXPECT_EQ(*read_file(folder / "m.texture1.png"), "mine");
}

TEST_F(Sequences, UsdNamesAreEachOnceAndIdentifiers) {
  SurfaceSequence sequence = sequence_of(1);
  sequence.actors = {"camera", "a b", "a b"};
  sequence.label_names.resize(3);
  auto writer = make_usd_writer(folder / "m.usda", sequence, true);
  ASSERT_TRUE(writer.ok());
  const std::vector<SurfaceFrame> frames(3, square());
  ASSERT_TRUE((*writer)->add(1, frames).ok());
  ASSERT_TRUE((*writer)->finish().ok());
  const std::string text = *read_file(folder / "m.usda");
  for (const char* part : {"def Xform \"camera_2\"", "def Xform \"a_b\"", "def Xform \"a_b_2\""})
    EXPECT_NE(text.find(part), std::string::npos) << part;
}

}  // namespace
}  // namespace polymorph
