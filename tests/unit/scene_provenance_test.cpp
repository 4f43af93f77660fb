#include "scene/provenance.h"

#include <gtest/gtest.h>

#include "base/packed_text.h"
#include "base/program_identity.h"
#include "base/sha256.h"
#include "scene/load_scene.h"
#include "testing/temporary_folder.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

std::string sha(const std::string& text) { return Sha256().add(text.data(), text.size()).hex(); }

class ProvenanceTest : public FolderTest {
 protected:
  void write(const fs::path& name, const std::string& text) const {
    fs::create_directories((folder / name).parent_path());
    std::ofstream(folder / name) << text;
  }
  /// A scene that changes most kinds of settings, in a folder beside that of its models.
  Scene rich_scene() {
    write("models/a.obj", "v 0 0 0\n");
    write("models/sky.hdr", "sky");
    write("scenes/rich.json", R"({
      "description": "a text that says nothing of the pictures",
      "actors": [
        {"name": "one", "source": {"model": "../models/a.obj", "color": "#336699", "crease": 30},
         "intermediate": [{"shape": "puddle", "meta": true, "retarget": 0.4}], "target": {"shape": "cube"},
         "plan": {"landmarks": {"a.obj": {"nose": [0.1, 0.2, 0.3], "hand": "v1"},
                                "puddle": {"nose": [1, 0, 0], "hand": "v2"}},
                  "labels": {"source": "model"}}},
        {"name": "one", "source": {"shape": "torus"}, "target": {"shape": "sphere"}, "start": 3}],
      "camera": {"azimuth": {"keys": [{"t": 0, "value": 0.1}, {"t": 1, "value": 33.3}]}},
      "lights": {"environment": "../models/sky.hdr", "lamps": [{"kind": "panel", "width": 0.7}]},
      "frames": {"count": 9}, "image": {"seed": 9007199254740991, "exposure": 0.3},
      "output": {"file": "/srv/films/frame.####.exr", "png_bits": 16}})");
    auto scene = load_scene(folder / "scenes/rich.json");
    EXPECT_TRUE(scene) << scene.error().message;
    return scene ? *scene : Scene{};
  }
  std::vector<ReadFile> read_files() const {
    return {{folder / "models/a.obj", sha("v 0 0 0\n")}, {folder / "models/sky.hdr", sha("sky")}};
  }
};

TEST_F(ProvenanceTest, HoldsTheWholeSceneAndNoPlace) {
  const Scene scene = rich_scene();
  const std::string packed = encode_provenance(make_provenance(scene, read_files()));
  EXPECT_LE(packed.size(), kMaxProvenance);
  const std::string text = *unpack_text(packed, 1u << 20);
  for (const char* hidden : {"says nothing", "/srv/films", "scenes/", "models/"})
    EXPECT_EQ(text.find(hidden), std::string::npos) << hidden << " in " << text;
  EXPECT_EQ(text.find(folder.string()), std::string::npos) << text;
  const auto read = decode_provenance(packed);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->version, program_version());
  EXPECT_EQ(read->program, shared_identity());
  ASSERT_EQ(read->files.size(), 2u);
  EXPECT_EQ(read->files[0].name, "a.obj");
  EXPECT_EQ(read->files[1].name, "sky.hdr");
  EXPECT_EQ(read->files[1].sha256, sha("sky"));
  // The scene that comes back is the one that went in, whose files lie elsewhere.
  fs::rename(folder / "models", folder / "elsewhere");
  const auto back = load_provenance_scene(*read, folder / "elsewhere", "frame.exr");
  ASSERT_TRUE(back) << back.error().message;
  Scene wanted = scene;
  wanted.description.clear();
  wanted.output.file = OutputSettings{}.file;
  wanted.actors[0].source.model = folder / "elsewhere/a.obj";
  wanted.lights.environment = folder / "elsewhere/sky.hdr";
  EXPECT_EQ(scene_to_json(*back, folder), scene_to_json(wanted, folder));
  // It gives the same provenance again.
  const std::vector<ReadFile> moved{{folder / "elsewhere/a.obj", sha("v 0 0 0\n")},
                                    {folder / "elsewhere/sky.hdr", sha("sky")}};
  EXPECT_EQ(encode_provenance(make_provenance(*back, moved)), packed);
}

TEST_F(ProvenanceTest, KeepsCoarseBalls) {
  Scene scene = rich_scene();
  for (ActorSettings& actor : scene.actors) actor.source.spheres.coarse = true;
  const auto read = decode_provenance(encode_provenance(make_provenance(scene, read_files())));
  ASSERT_TRUE(read);
  EXPECT_TRUE(read->coarse);
  const auto back = load_provenance_scene(*read, folder / "models", "frame.exr");
  ASSERT_TRUE(back);
  EXPECT_TRUE(back->actors[0].source.spheres.coarse);
  EXPECT_TRUE(back->actors[1].target.spheres.coarse);
}

TEST_F(ProvenanceTest, JoinsFilesWhereTheyAreMany) {
  Scene scene = rich_scene();
  std::vector<ReadFile> files = read_files();
  for (int i = 0; i < 500; ++i)
    files.push_back({folder / fmt::format("models/seq.{:04}.obj", i), sha(fmt::format("{}", i))});
  Provenance made = make_provenance(scene, files);
  const std::vector<InputFile> all = made.files;
  const std::string packed = encode_provenance(made);
  EXPECT_LE(packed.size(), kMaxProvenance);
  const auto read = decode_provenance(packed);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_FALSE(read->scene.empty());
  ASSERT_EQ(read->files.size(), 3u);
  EXPECT_EQ(read->files[1].name, "seq.#.obj");
  EXPECT_EQ(read->files[1].count, 500);
  // As `sha256sum seq.*.obj | sha256sum` says.
  std::string lines;
  for (int i = 0; i < 500; ++i)
    lines += fmt::format("{}  seq.{:04}.obj\n", sha(fmt::format("{}", i)), i);
  EXPECT_EQ(read->files[1].sha256, sha(lines));
  EXPECT_TRUE(compare_inputs(read->files, all).empty());
  std::vector<InputFile> changed = all;
  changed[100].sha256 = sha("another");
  const std::vector<std::string> found = compare_inputs(read->files, changed);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].starts_with("seq.#.obj: together these files have SHA-256 ")) << found[0];
  changed.erase(changed.begin() + 100);
  ASSERT_EQ(compare_inputs(read->files, changed).size(), 1u);
}

TEST_F(ProvenanceTest, LeavesOutWhatIsTooLarge) {
  Scene scene = rich_scene();
  std::vector<ReadFile> files = read_files();
  // Names without digits are joined with all others.
  for (int i = 0; i < 500; ++i) {
    const std::string name = fmt::format("{}{}{}", static_cast<char>('a' + i % 26),
                                         static_cast<char>('a' + i / 26 % 26), "x");
    files.push_back({folder / "models" / name, sha(name)});
  }
  auto read = decode_provenance(encode_provenance(make_provenance(scene, files)));
  ASSERT_TRUE(read);
  ASSERT_EQ(read->files.size(), 1u);
  EXPECT_EQ(read->files[0].name, kAllFiles);
  EXPECT_EQ(read->files[0].count, 502);
  EXPECT_TRUE(compare_inputs(read->files, make_provenance(scene, files).files).empty());
  EXPECT_FALSE(compare_inputs(read->files, make_provenance(scene, read_files()).files).empty());
  // A scene of hundreds of objects in places that nobody could guess.
  for (int i = 0; i < 400; ++i) {
    ActorSettings actor = scene.actors[1];
    const float x = 1.0f / static_cast<float>(i + 3);
    actor.translate = {x, x * x, 1 / (x + 0.1f)};
    actor.name = sha(std::to_string(i));
    scene.actors.push_back(actor);
  }
  const std::string packed = encode_provenance(make_provenance(scene, read_files()));
  EXPECT_LE(packed.size(), kMaxProvenance);
  read = decode_provenance(packed);
  ASSERT_TRUE(read);
  EXPECT_TRUE(read->scene.empty());
  const auto back = load_provenance_scene(*read, folder / "models", "frame.exr");
  ASSERT_FALSE(back);
  EXPECT_NE(back.error().message.find("too large for a header"), std::string::npos);
}

TEST_F(ProvenanceTest, NamesWhatDiffers) {
  const std::vector<InputFile> of_frame{{"a", sha("1")}, {"b", sha("2")}, {"c", sha("3")}};
  const std::vector<InputFile> read{{"a", sha("1")}, {"b", sha("9")}, {"d", sha("4")}};
  const std::vector<std::string> lines = compare_inputs(of_frame, read);
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[0],
            "b: has SHA-256 " + sha("9") + " now, and the frame was made from " + sha("2"));
  EXPECT_EQ(lines[1], "c: was read for the frame, and is not now");
  EXPECT_EQ(lines[2], "d: is read now, and was not for the frame");
}

TEST_F(ProvenanceTest, RefusesHostileTexts) {
  const std::string good = R"("version":"1","program":"p",)";
  const std::string digest = sha("x");
  const auto refused = [&](const std::string& json) {
    const auto read = decode_provenance(pack_text(json));
    EXPECT_FALSE(read) << json;
    return read ? "" : read.error().message;
  };
  EXPECT_FALSE(decode_provenance("gibberish"));
  EXPECT_FALSE(decode_provenance(std::string(1u << 20, 'A')));
  EXPECT_FALSE(decode_provenance(pack_text(std::string(8u << 20, ' '))));
  for (const std::string& json :
       {std::string("7"), std::string("[]"), std::string("{}"), std::string("{"),
        std::string(R"({"format":2,)") + good + R"("files":{}})",
        std::string(R"({"format":"1",)") + good + R"("files":{}})",
        std::string(R"({"format":1,"files":{}})"),
        std::string(R"({"format":1,)") + good + R"("files":[]})",
        std::string(R"({"format":1,)") + good + R"("files":{"a":"12"}})",
        std::string(R"({"format":1,)") + good + R"("files":{"a":{"count":-1,"sha256":")" + digest +
            R"("}}})",
        std::string(R"({"format":1,)") + good + R"("files":{},"scene":"a"})",
        std::string(100'000, '[')})
    refused(json);
  for (const char* name : {"../a", "/etc/passwd", "a/../../b", "", "a\\u0000b", "a\\nb"})
    EXPECT_NE(refused(std::string(R"({"format":1,)") + good + R"("files":{")" + name + R"(":")" +
                      digest + R"("}})")
                  .find("is no name of a file below a folder"),
              std::string::npos);
  for (const char* scene :
       {R"({"source":"../a.obj"})", R"({"source":{"model":"/etc/passwd"}})",
        R"({"actors":[{"source":{"shape":"cube"},"intermediate":["../b.obj"]}]})",
        R"({"actors":[{"source":{"shape":"cube"},"intermediate":[{"model":"a/../../b.obj"}]}]})",
        R"({"target":{"model":"../seq.####.obj"}})", R"({"lights":{"environment":"/dev/zero"}})"})
    EXPECT_NE(
        refused(std::string(R"({"format":1,)") + good + R"("files":{},"scene":)" + scene + "}")
            .find("which is no file below a folder"),
        std::string::npos);
}

}  // namespace
}  // namespace polymorph
