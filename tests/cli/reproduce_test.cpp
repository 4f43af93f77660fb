// Frames that are rendered again from their headers alone.
#include <nlohmann/json.hpp>

#include "base/packed_text.h"
#include "base/sha256.h"
#include "image/image_io.h"
#include "testing/program.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

constexpr const char* kProvenance = "polymorph/provenance";

class Reproduce : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("models/tetra.obj",
          "mtllib tetra.mtl\nusemtl skin\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
          "vt 0 0\nvt 1 0\nvt 0 1\n"
          "f 1/1 3/2 2/3\nf 1/1 2/2 4/3\nf 1/1 4/2 3/3\nf 2/1 3/2 4/3\n");
    write("models/tetra.mtl", "newmtl skin\nKd 1 1 1\nmap_Kd textures/skin.png\n");
    Image skin = make_image(4, 4, {"R", "G", "B"});
    for (std::size_t i = 0; i < skin.pixels.size(); ++i)
      skin.pixels[i] = 0.1f + 0.017f * static_cast<float>(i);
    write("models/textures/skin.png", *encode_png(skin));
    write("scenes/scene.json",
          tiny_scene(4, R"({"model": "../models/tetra.obj", "spheres": {"balls": 8}})"));
  }

  /// Renders frame 1, which shows the texture, as EXR and PNG.
  void render() {
    run(0, {"render", "scenes/scene.json", "-o", "f.####.exr", "-f", "1,2", "--png"});
  }
  static Image read(const fs::path& file) {
    auto image = read_image(file);
    EXPECT_TRUE(image) << image.error().message;
    return image ? *image : Image{};
  }
  static std::string entry(const Image& image, const std::string& name) {
    for (const Attribute& attribute : image.attributes)
      if (attribute.name == name && std::holds_alternative<std::string>(attribute.value))
        return std::get<std::string>(attribute.value);
    return "";
  }
  static nlohmann::json provenance(const Image& image) {
    const auto text = unpack_text(entry(image, kProvenance), 1u << 20);
    EXPECT_TRUE(text) << text.error().message;
    return parse(text ? *text : "{}");
  }
  /// Copies a frame and gives the copy another entry in its header.
  void forge_entry(const std::string& from, const std::string& to, const Attribute& entry) const {
    Image image = read(folder / from);
    std::erase_if(image.attributes, [&](const Attribute& old) { return old.name == entry.name; });
    image.attributes.push_back(entry);
    const auto bytes = encode_exr(image);
    ASSERT_TRUE(bytes) << bytes.error().message;
    write(to, *bytes);
  }
  void forge(const std::string& from, const std::string& to, const nlohmann::json& json) const {
    forge_entry(from, to, {kProvenance, pack_text(json.dump())});
  }
};

TEST_F(Reproduce, FramesGiveTheSameBits) {
  render();
  for (const char* frame : {"f.0001.exr", "f.0001.png", "f.0002.exr", "f.0002.png"}) {
    const Ran ran = run(0, {"reproduce", frame, "--models", "models"});
    EXPECT_EQ(ran.out, std::string(frame) + ": same bits, every byte of the file\n");
  }
  // With the folder that the models were moved to, and nothing else.
  fs::rename(folder / "models", folder / "moved");
  fs::remove_all(folder / "scenes");
  run(0, {"reproduce", "f.0001.exr", "--models", "moved/", "-o", "again.exr"});
  EXPECT_EQ(read_text(folder / "again.exr"), read_text(folder / "f.0001.exr"));
  run(4, {"reproduce", "f.0001.exr", "--models", "moved", "-o", "again.exr"});
  run(2, {"reproduce", "f.0001.exr", "--models", "moved", "-o", "again.png"});
  const auto json = parse(run(0, {"reproduce", "f.0002.png", "--models", "moved", "--json"}).out);
  EXPECT_EQ(json["frame"], 2);
  EXPECT_EQ(json["same_pixels"], true);
  EXPECT_EQ(json["same_program"], true);
}

TEST_F(Reproduce, SettingsOfTheCommandLineAreInTheHeader) {
  run(0,
      {"render", "scenes/scene.json", "-o", "p.exr", "-f", "2", "--preview", "--set",
       "camera.azimuth=77", "--set", "image.aovs=label,N", "--set", "output.png_bits=16", "--png"});
  EXPECT_EQ(provenance(read(folder / "p.exr"))["coarse"], true);
  run(0, {"reproduce", "p.exr", "--models", "models"});
  run(0, {"reproduce", "p.png", "--models", "models"});
  run(0, {"render", "models/tetra.obj", "--turntable", "-f", "7", "-o", "t.png", "--set",
          "image.width=32", "--set", "image.height=24", "--set", "image.samples=1"});
  run(0, {"reproduce", "t.png", "--models", "models"});
  run(0, {"render", "scenes/scene.json", "-o", "a.png", "-f", "2", "--set", "image.aovs=all"});
  run(0, {"reproduce", "a.png", "--models", "models"});
}

TEST_F(Reproduce, GoldenFramesProveThemselves) {
  // As the golden suites' renderer writes them, EXR; and as render does, EXR and PNG.
  for (const auto& [suite, frame] : {std::pair("monkey-torus", 4), std::pair("report-method", 9),
                                     std::pair("puddle-chain", 16)}) {
    const std::string name = suite, number = std::to_string(frame);
    const std::string scene = (source_dir() / "scenes/golden" / (name + ".json")).string();
    const std::string models = (source_dir() / "scenes/models").string();
    run(0, {"render", scene, "-f", number, "-o", name + ".exr", "--png"});
    for (const char* format : {".exr", ".png"}) {
      const Ran ran = run(0, {"reproduce", name + format, "--models", models});
      EXPECT_EQ(ran.out, name + format + ": same bits, every byte of the file\n");
    }
    // The golden itself shows the same, and is made again from its header alone.
    const fs::path golden = source_dir() / "golden_frames" / name /
                            ("frame." + std::string(4 - number.size(), '0') + number + ".exr");
    EXPECT_EQ(read(golden).pixels, read(folder / (name + ".exr")).pixels) << name;
    const Ran ran = run(0, {"reproduce", golden.string(), "--models", models});
    EXPECT_TRUE(contains(ran.out, ": same bits")) << ran.out;
  }
  run(0, {"golden", "new", "tiny", "scenes/scene.json", "-f", "1,3", "--reason", "first"});
  for (const char* frame : {"1", "3"})
    run(0, {"reproduce", std::string("golden_frames/tiny/frame.000") + frame + ".exr", "--models",
            "models"});
}

TEST_F(Reproduce, AFlippedBitIsNamed) {
  render();
  // In a texture, at a place where the decoder does not see it: the last byte of a chunk's sum.
  for (const char* name : {"textures/skin.png", "tetra.mtl", "tetra.obj"}) {
    const fs::path file = folder / "models" / name;
    const std::string before = read_text(file);
    std::string after = before;
    after.back() = static_cast<char>(after.back() ^ 1);
    write(fs::path("models") / name, after);
    const Ran ran = run(1, {"reproduce", "f.0001.exr", "--models", "models"});
    EXPECT_TRUE(ran.out.starts_with(std::string("f.0001.exr: differs: ") + name + ": has SHA-256 "))
        << ran.out;
    EXPECT_EQ(lines_of(ran.out).size(), 1u) << ran.out;
    write(fs::path("models") / name, before);
  }
  const fs::path texture = folder / "models/textures/skin.png";
  fs::rename(texture, folder / "skin.png");
  const Ran ran = run(3, {"reproduce", "f.0001.exr", "--models", "models"});
  EXPECT_TRUE(contains(ran.out, "models/textures/skin.png: cannot read")) << ran.out;
  EXPECT_TRUE(contains(ran.err, "--models names the folder")) << ran.err;
  run(3, {"reproduce", "f.0001.exr", "--models", "nowhere"});
  // A picture that the frame was made without, as it was not there.
  run(0, {"render", "scenes/scene.json", "-o", "bare.exr", "-f", "1"});
  fs::rename(folder / "skin.png", texture);
  const Ran more = run(1, {"reproduce", "bare.exr", "--models", "models"});
  EXPECT_TRUE(contains(more.out, "textures/skin.png: is read now, and was not")) << more.out;
}

TEST_F(Reproduce, ChangedFramesAndHeadersAreFound) {
  render();
  // A pixel's last bit.
  Image image = read(folder / "f.0001.exr");
  const auto z = static_cast<std::size_t>(image.find_channel("Z"));
  std::uint32_t bits = 0;
  std::memcpy(&bits, &image.pixels[z], 4);
  bits ^= 1;
  std::memcpy(&image.pixels[z], &bits, 4);
  write("changed.exr", *encode_exr(image));
  const Ran changed = run(1, {"reproduce", "changed.exr", "--models", "models"});
  EXPECT_TRUE(changed.out.starts_with("changed.exr: differs: ")) << changed.out;
  // Another setting of the scene in the header.
  nlohmann::json json = provenance(image);
  json["scene"]["image"]["seed"] = 5;
  forge("f.0001.exr", "seed.exr", json);
  run(1, {"reproduce", "seed.exr", "--models", "models"});
  // An entry of the header that decides no pixel.
  forge_entry("f.0001.exr", "stage.exr", {"polymorph/stage", std::string("another")});
  const Ran stage = run(0, {"reproduce", "stage.exr", "--models", "models"});
  EXPECT_TRUE(contains(stage.out, "same bits in every pixel; its header")) << stage.out;
}

TEST_F(Reproduce, AForeignVersionIsNamed) {
  render();
  nlohmann::json json = provenance(read(folder / "f.0001.exr"));
  const std::string identity = json["program"];
  EXPECT_TRUE(contains(run(0, {"version"}).out, identity));
  json["version"] = "0.0.7";
  json["program"] = "deadbeef GNU 4.8";
  forge("f.0001.exr", "foreign.exr", json);
  const Ran same = run(0, {"reproduce", "foreign.exr", "--models", "models"});
  EXPECT_TRUE(contains(same.out,
                       "same bits in every pixel, by another build: it is of 0.0.7 (deadbeef GNU "
                       "4.8), this is "))
      << same.out;
  json["scene"]["image"]["seed"] = 5;
  forge("f.0001.exr", "foreign.exr", json);
  const Ran other = run(1, {"reproduce", "foreign.exr", "--models", "models"});
  EXPECT_TRUE(contains(other.out, "of another build, 0.0.7")) << other.out;
}

TEST_F(Reproduce, HeadersTellNoPlaceAndNoUser) {
  const fs::path home = folder / "home/secretuser";
  fs::create_directories(home / "film");
  fs::rename(folder / "models", home / "film/models");
  fs::rename(folder / "scenes", home / "film/scenes");
  variables = {{"HOME", home.string()}, {"USER", "secretuser"}};
  write("home/secretuser/sky.exr", *encode_exr(make_image(2, 1, {"R", "G", "B"})));
  run(0, {"render", (home / "film/scenes/scene.json").string(), "-o", (home / "f.exr").string(),
          "-f", "1", "--png", "--set", "lights.environment=\"" + (home / "sky.exr").string() + "\"",
          "--cache-dir=" + home.string(), "--set",
          "output.file=\"" + (home / "g.exr").string() + "\""});
  for (const char* name : {"f.exr", "f.png"}) {
    const std::string bytes = read_text(home / name);
    EXPECT_FALSE(contains(bytes, "secretuser")) << name;
    EXPECT_FALSE(contains(bytes, folder.string())) << name;
    const Image image = read(home / name);
    EXPECT_TRUE(
        contains(entry(image, "polymorph/command"),
                 "render scene.json -o f.exr -f 1 --png --set lights.environment=\"sky.exr\" "
                 "--cache-dir=~"))
        << entry(image, "polymorph/command");
    EXPECT_LE(entry(image, kProvenance).size(), 8000u);
    const std::string text = provenance(image).dump();
    EXPECT_FALSE(contains(text, "secretuser")) << text;
    EXPECT_FALSE(contains(text, folder.string())) << text;
    EXPECT_TRUE(contains(text, "film/models/textures/skin.png")) << text;
    run(0, {"reproduce", (home / name).string(), "--models", home.string()});
  }
}

TEST_F(Reproduce, AReceiptNamesFramesAndInputs) {
  const std::vector<std::string> command{
      "render", "scenes/scene.json", "-o",    "out/f.####.exr", "-f", "2,1",
      "--png",  "--receipt",         "r.json"};
  run(0, command);
  const std::string text = read_text(folder / "r.json");
  const auto receipt = parse(text);
  EXPECT_EQ(receipt["_type"], "https://in-toto.io/Statement/v1");
  EXPECT_EQ(receipt["predicateType"], "https://slsa.dev/provenance/v1");
  const auto digest = [&](const fs::path& file) {
    const std::string bytes = read_text(folder / file);
    return Sha256().add(bytes.data(), bytes.size()).hex();
  };
  ASSERT_EQ(receipt["subject"].size(), 4u);
  int i = 0;
  for (const std::string name : {"f.0001.exr", "f.0001.png", "f.0002.exr", "f.0002.png"}) {
    EXPECT_EQ(receipt["subject"][i]["name"], name);
    EXPECT_EQ(receipt["subject"][i++]["digest"]["sha256"], digest("out/" + name));
  }
  const auto& build = receipt["predicate"]["buildDefinition"];
  EXPECT_EQ(build["externalParameters"]["frames"], "1-2");
  EXPECT_EQ(build["externalParameters"]["scene"]["image"]["width"], 32);
  ASSERT_EQ(build["resolvedDependencies"].size(), 3u);
  i = 0;
  for (const std::string name : {"tetra.mtl", "tetra.obj", "textures/skin.png"}) {
    EXPECT_EQ(build["resolvedDependencies"][i]["name"], name);
    EXPECT_EQ(build["resolvedDependencies"][i++]["digest"]["sha256"], digest("models/" + name));
  }
  const auto& builder = receipt["predicate"]["runDetails"]["builder"];
  EXPECT_TRUE(contains(run(0, {"version"}).out, builder["version"]["build"].get<std::string>()));
  EXPECT_FALSE(contains(text, folder.string())) << text;
  // The same again from nothing, and where a run is resumed.
  fs::remove_all(folder / "out");
  run(4, command);
  fs::remove(folder / "r.json");
  run(0, command);
  EXPECT_EQ(read_text(folder / "r.json"), text);
  std::vector<std::string> resumed = command;
  resumed.emplace_back("--skip-existing");
  run(0, resumed);
  EXPECT_EQ(read_text(folder / "r.json"), text);
}

TEST_F(Reproduce, HostileHeadersAreErrors) {
  render();
  const nlohmann::json good = provenance(read(folder / "f.0001.exr"));
  const auto refused = [&](const std::string& part) {
    const Ran ran = run(3, {"reproduce", "hostile.exr", "--models", "models"});
    EXPECT_TRUE(contains(ran.err, "hostile.exr: ")) << ran.err;
    EXPECT_TRUE(contains(ran.err, part)) << ran.err;
    EXPECT_EQ(ran.out, "");
  };
  const std::string packed = pack_text(good.dump());
  for (const std::string& text :
       {std::string("x"), std::string(200'000, 'A'), packed.substr(0, packed.size() / 2),
        pack_text(std::string(16u << 20, '[')), pack_text("{}"), pack_text("\xff\xfe")}) {
    forge_entry("f.0001.exr", "hostile.exr", {kProvenance, text});
    refused("the provenance in the header cannot be used");
  }
  forge_entry("f.0001.exr", "hostile.exr", {kProvenance, 7});
  refused("the provenance in the header cannot be used");
  for (const int frame : {0, -3, 5, 2'000'000'000}) {
    forge_entry("f.0001.exr", "hostile.exr", {"polymorph/frame", frame});
    refused("header");
  }
  const auto with = [&](const char* pointer, const nlohmann::json& value) {
    nlohmann::json json = good;
    json[nlohmann::json::json_pointer(pointer)] = value;
    forge("f.0001.exr", "hostile.exr", json);
  };
  // What lies outside of the folder is never looked at, whether it is there or not.
  for (const char* path : {"/etc/passwd", "../scenes/scene.json", "../nothing", "/dev/zero"}) {
    with("/scene/actors/0/source/model", path);
    refused("which is no file below a folder");
    with("/scene/lights/environment", path);
    refused("which is no file below a folder");
    nlohmann::json json = good;
    json["files"][path] = std::string(64, '0');
    forge("f.0001.exr", "hostile.exr", json);
    refused("is no name of a file below a folder");
  }
  with("/scene/image/width", -1);
  refused("/image/width");
  with("/scene/nonsense", 1);
  refused("/nonsense");
  with("/format", 2);
  refused("it has format 2");
  // A file that holds none, and none at all.
  write("plain.exr", *encode_exr(make_image(2, 2, {"R", "G", "B"})));
  EXPECT_TRUE(contains(run(3, {"reproduce", "plain.exr"}).err, "its header has no polymorph/prov"));
  write("text.exr", "no image");
  run(3, {"reproduce", "text.exr"});
  run(3, {"reproduce", "gone.exr"});
  // A picture that no memory holds.
  with("/scene/image/width", 32768);
  nlohmann::json json = provenance(read(folder / "hostile.exr"));
  json["scene"]["image"]["height"] = 32768;
  forge("f.0001.exr", "hostile.exr", json);
  run(5, {"reproduce", "hostile.exr", "--models", "models", "--max-memory", "1G"});
}

}  // namespace
}  // namespace polymorph
