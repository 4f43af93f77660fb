// What mesh writes for other programs.
#include <cstring>

#include "testing/program.h"

namespace polymorph {
namespace {

class Interchange : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("scene.json", tiny_scene(6));
  }
  static nlohmann::json glb_json(const std::string& glb) {
    // The file's magic, version and length, then the length and type of the JSON chunk.
    std::uint32_t head[5] = {};
    std::memcpy(head, glb.data(), sizeof head);
    EXPECT_EQ(head[0], 0x46546c67u);
    EXPECT_EQ(head[2], glb.size());
    return parse(glb.substr(20, head[3]));
  }
};

TEST_F(Interchange, AGlbShowsOneFrameAtATime) {
  const Ran ran = run(0, {"mesh", "scene.json", "-o", "m.glb"});
  EXPECT_TRUE(ran.out.starts_with("m.glb 6 frames, 1 actor, ")) << ran.out;
  const auto json = glb_json(read_text(folder / "m.glb"));
  const auto& nodes = json["nodes"];
  ASSERT_EQ(json["meshes"].size(), 6u);
  for (std::size_t n = 0; n < 6; ++n)
    EXPECT_EQ(nodes[n].value("scale", nlohmann::json{1, 1, 1})[0].get<double>(), n == 0 ? 1 : 0);
  const auto& animation = json["animations"][0];
  // Two channels per frame: the scale, and the visibility for viewers that know it.
  EXPECT_EQ(animation["channels"].size(), 12u);
  for (const auto& sampler : animation["samplers"]) EXPECT_EQ(sampler["interpolation"], "STEP");
  const auto& visible = animation["channels"][1]["target"]["extensions"]["KHR_animation_pointer"];
  EXPECT_EQ(visible["pointer"], "/nodes/0/extensions/KHR_node_visibility/visible");
  // The file exists, and --overwrite is missing.
  run(4, {"mesh", "scene.json", "-o", "m.glb"});
}

TEST_F(Interchange, FramesThatAreAlikeAreOneMesh) {
  run(0, {"mesh", "scene.json", "-o", "m.glb", "--set", "frames.hold_start=3"});
  EXPECT_EQ(glb_json(read_text(folder / "m.glb"))["meshes"].size(), 3u)
      << "six frames, of which the first four are one";
  EXPECT_TRUE(contains(
      run(0, {"mesh", "scene.json", "-o", "n.glb", "--set", "frames.hold_start=3", "-f", "1-4"})
          .out,
      "n.glb 4 frames"));
  EXPECT_EQ(glb_json(read_text(folder / "n.glb"))["meshes"].size(), 1u);
}

TEST_F(Interchange, QuantizedAndSimplifiedIsSmaller) {
  run(0, {"mesh", "scene.json", "-o", "m.glb"});
  run(0, {"mesh", "scene.json", "-o", "q.glb", "--quantize", "--error", "0.5%"});
  EXPECT_LT(2 * std::filesystem::file_size(folder / "q.glb"),
            std::filesystem::file_size(folder / "m.glb"));
  const auto json = glb_json(read_text(folder / "q.glb"));
  EXPECT_EQ(json["extensionsRequired"][0], "KHR_mesh_quantization");
  EXPECT_TRUE(contains(run(2, {"mesh", "scene.json", "-o", "x.ply", "--quantize"}).err,
                       "--quantize is for .glb files"));
  for (const char* wrong : {"0", "20%", "much"})
    EXPECT_TRUE(contains(run(2, {"mesh", "scene.json", "-o", "x.glb", "--error", wrong}).err,
                         "is not a share of the diagonal"));
  EXPECT_FALSE(exists("x.glb"));
}

TEST_F(Interchange, UsdHasSamplesOfEverything) {
  run(0, {"mesh", "scene.json", "-o", "m.usda"});
  const std::string usd = read_text(folder / "m.usda");
  EXPECT_TRUE(usd.starts_with("#usda 1.0\n"));
  for (const char* part :
       {"upAxis = \"Y\"", "metersPerUnit = 1", "timeCodesPerSecond = 24", "def Xform \"cube\"",
        "def Mesh \"surface\"", "def Camera \"camera\"", "subdivisionScheme = \"none\"",
        "int[] faceVertexIndices.timeSamples", "vector3f[] velocities.timeSamples",
        "color3f[] primvars:displayColor.timeSamples", "texCoord2f[] primvars:st.timeSamples",
        "int[] primvars:label.timeSamples"})
    EXPECT_TRUE(contains(usd, part)) << part;
  EXPECT_EQ(count_files(".part"), 0u);
}

TEST_F(Interchange, ACameraWithKeyframesMovesInTheFile) {
  const std::vector<std::string> moving{
      "--set", R"(camera.azimuth={"keys": [{"frame": 1, "value": 0}, {"frame": 6, "value": 90}]})"};
  for (const char* name : {"m.usda", "m.glb"}) {
    std::vector<std::string> command{"mesh", "scene.json", "-o", name};
    command.insert(command.end(), moving.begin(), moving.end());
    run(0, command);
  }
  const std::string usd = read_text(folder / "m.usda");
  const std::size_t samples = usd.find("matrix4d xformOp:transform.timeSamples = {");
  ASSERT_NE(samples, std::string::npos) << usd.substr(usd.find("def Camera"));
  EXPECT_TRUE(contains(usd.substr(samples, usd.find('}', samples) - samples), "\n            6: "));
  const auto json = glb_json(read_text(folder / "m.glb"));
  std::size_t moved = 0;
  // The camera is the last node.
  for (const auto& channel : json["animations"][0]["channels"])
    moved += channel["target"].value("node", 0u) + 1 == json["nodes"].size();
  EXPECT_EQ(moved, 2u) << "translation and rotation";
}

TEST_F(Interchange, AnObjIsReadAgainInItsColours) {
  write("scene.json", tiny_scene(4, R"({"shape": "cube", "color": "#ff0000"})"));
  run(0, {"mesh", "scene.json", "-f", "2", "-o", "m.obj"});
  write("again.json", tiny_scene(4, R"("m.obj")"));
  run(0, {"mesh", "again.json", "-f", "1", "-o", "n.obj"});
  EXPECT_TRUE(contains(read_text(folder / "n.mtl"), "newmtl color_"))
      << read_text(folder / "n.mtl");
}

TEST_F(Interchange, AnObjHasItsMaterialsAndTexturesBesideIt) {
  write("scene.json",
        tiny_scene(4, "\"" + (source_dir() / "scenes/models/penguin.obj").string() + "\"",
                   "  \"spheres\": {\"balls\": 12},\n"));
  run(0, {"mesh", "scene.json", "-f", "1-2", "-o", "m.####.obj"});
  const std::string mtl = read_text(folder / "m.mtl");
  EXPECT_TRUE(contains(mtl, "map_Kd m.texture1.png\n")) << mtl;
  EXPECT_TRUE(exists("m.texture1.png"));
  EXPECT_TRUE(contains(read_text(folder / "m.0002.obj"), "mtllib m.mtl\n"));
  // The program reads it again, with the texture.
  EXPECT_EQ(parse(run(0, {"info", "m.0002.obj", "--json"}).out)["textures"], 1);
  EXPECT_TRUE(contains(run(4, {"mesh", "scene.json", "-f", "3-4", "-o", "m.####.obj"}).err,
                       "m.mtl: exists - add --overwrite"));
}

TEST_F(Interchange, OneMeshIsCarriedThroughALeg) {
  write("scene.json",
        tiny_scene(3, R"({"shape": "sphere", "scale": 0.8, "spheres": {"balls": 6}})"));
  run(0, {"mesh", "scene.json", "--set", "surface.resolution=24", "--topology", "constant", "-o",
          "m.glb"});
  const auto json = glb_json(read_text(folder / "m.glb"));
  ASSERT_EQ(json["meshes"].size(), 1u);
  const auto& mesh = json["meshes"][0];
  EXPECT_EQ(mesh["weights"].size(), 2u);
  for (const auto& primitive : mesh["primitives"]) {
    ASSERT_EQ(primitive["targets"].size(), 2u);
    for (const auto& target : primitive["targets"])
      EXPECT_TRUE(target.contains("POSITION") && target.contains("NORMAL"));
  }
  const auto& animation = json["animations"][0];
  EXPECT_EQ(animation["channels"][0]["target"]["path"], "weights");
  EXPECT_EQ(animation["samplers"][0]["interpolation"], "LINEAR");

  run(0, {"mesh", "scene.json", "--set", "surface.resolution=24", "--topology", "constant", "-o",
          "m.usda"});
  const std::string usd = read_text(folder / "m.usda");
  EXPECT_TRUE(contains(usd, "int[] faceVertexIndices = ["));
  EXPECT_TRUE(contains(usd, "int[] faceVertexCounts = ["));
  EXPECT_TRUE(contains(usd, "point3f[] points.timeSamples"));

  run(0, {"mesh", "scene.json", "--set", "surface.resolution=24", "--topology", "constant", "-o",
          "m.####.obj"});
  const auto faces = [&](const char* name) {
    const std::string text = read_text(folder / name);
    return text.substr(text.find("\nf "));
  };
  EXPECT_EQ(faces("m.0001.obj"), faces("m.0003.obj"));

  for (const std::vector<std::string>& wrong :
       {std::vector<std::string>{"x.glb", "--quantize"}, {"x.glb", "--error", "1%"}, {"x.json"}}) {
    std::vector<std::string> arguments = {
        "mesh", "scene.json", "--set", "surface.resolution=24", "--topology", "constant", "-o"};
    arguments.insert(arguments.end(), wrong.begin(), wrong.end());
    EXPECT_TRUE(contains(run(2, arguments).err, "leave out --error and --quantize"));
  }
}

TEST_F(Interchange, AChangingTopologyIsRefusedByFrameAndPlace) {
  write("scene.json", tiny_scene(6, "\"torus\""));
  const std::string said =
      run(3, {"mesh", "scene.json", "--topology", "constant", "-o", "m.glb"}).err;
  EXPECT_TRUE(contains(said, "the topology changes: frame ")) << said;
  EXPECT_TRUE(contains(said, "they differ most at (")) << said;
  EXPECT_TRUE(contains(said, "leave out --topology for a mesh of its own in each frame")) << said;
  EXPECT_FALSE(exists("m.glb"));
}

}  // namespace
}  // namespace polymorph
