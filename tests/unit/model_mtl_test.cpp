#include "model/load/mtl.h"

#include <gtest/gtest.h>

#include <cmath>

#include "image/image_io.h"
#include "model/load/asset_path.h"
#include "model/load/load_obj.h"
#include "testing/model.h"

namespace polymorph {
namespace {

Material only_material(std::string_view text) {
  const auto set = parse_mtl(text, "a.mtl");
  EXPECT_TRUE(set) << (set ? "" : set.error().message);
  EXPECT_EQ(set->materials.size(), 1u);
  return set->materials.at(0).material;
}

TEST(ParseMtl, MapsPhongToRoughnessAndKeepsColoursLinear) {
  const Material m = only_material("newmtl Red Paint\nKd 0.8 0.1 0.05\nNs 30\nKs 0.1 0.1 0.1\n");
  EXPECT_EQ(m.name, "Red Paint");
  EXPECT_EQ(m.color, (Vec3{0.8f, 0.1f, 0.05f}));
  EXPECT_FLOAT_EQ(m.roughness, 0.25f);  // sqrt(2 / 32)
  EXPECT_EQ(m.specular, (Vec3{0.1f, 0.1f, 0.1f}));
  EXPECT_EQ(m.metallic, 0);
}

TEST(ParseMtl, KeepsDefaultsForWhatIsNotGiven) {
  const Material m = only_material("newmtl a\n"), standard;
  EXPECT_EQ(m.color, standard.color);
  EXPECT_EQ(m.specular, standard.specular);
  EXPECT_EQ(m.roughness, standard.roughness);
}

TEST(ParseMtl, ClampsAndPrefersThePbrValues) {
  const Material bright = only_material("newmtl a\nKd 7 -1 0.5\nKs 1 1 1\nNs -5\n");
  EXPECT_EQ(bright.color, (Vec3{1, 0, 0.5f}));
  EXPECT_EQ(bright.specular, (Vec3{0.2f, 0.2f, 0.2f}))
      << "a highlight's strength is no reflectance";
  EXPECT_EQ(bright.roughness, 1);
  const Material metal = only_material("newmtl a\nKs 0.9\nNs 30\nPr 0.6\nPm 1\n");
  EXPECT_EQ(metal.specular, (Vec3{0.9f, 0.9f, 0.9f}));
  EXPECT_EQ(metal.roughness, 0.6f);
  EXPECT_EQ(metal.metallic, 1);
}

TEST(ParseMtl, ATextureWithoutKdOrWithABlackOneShowsAsItIs) {
  EXPECT_EQ(only_material("newmtl a\nmap_Kd t.png\n").color, (Vec3{1, 1, 1}));
  EXPECT_EQ(only_material("newmtl a\nKd 0 0 0\nmap_Kd t.png\n").color, (Vec3{1, 1, 1}));
  EXPECT_EQ(only_material("newmtl a\nmap_Kd t.png\nKd 0.5 0.5 0.5\n").color,
            (Vec3{0.5f, 0.5f, 0.5f}));
}

TEST(ParseMtl, TextureOptionsAndNamesWithSpaces) {
  const auto set =
      parse_mtl("newmtl a\nmap_Kd -s 2 3 1 -o 0.5 0.25 0 -clamp on my wood.png\n", "a.mtl");
  ASSERT_TRUE(set);
  EXPECT_EQ(set->materials[0].texture, "my wood.png");
  EXPECT_EQ(set->materials[0].uv_scale, (Vec2{2, 3}));
  EXPECT_EQ(set->materials[0].uv_offset, (Vec2{0.5f, 0.25f}));
  EXPECT_EQ(set->materials[0].texture_line, 2u);
}

TEST(ParseMtl, ErrorsNameTheLine) {
  const std::pair<std::string, const char*> cases[] = {
      {"newmtl a\nKd 1 x 0\n", "a.mtl:2: Kd value \"x\" is not a number"},
      {"newmtl a\nKd 1 0\n", "a.mtl:2: Kd has 2 of 3"},
      {"newmtl a\nNs nan\n", "a.mtl:2: Ns value \"nan\" is not a finite"},
      {"newmtl a\nNs\n", "a.mtl:2: Ns has 0 of 1"},
      {"newmtl\n", "a.mtl:1: newmtl has no name"},
      {std::string("newmtl a\0\n", 10), "a.mtl: is not text"},
  };
  for (const auto& [text, expected] : cases) {
    const auto set = parse_mtl(text, "a.mtl");
    ASSERT_FALSE(set) << text;
    EXPECT_EQ(set.error().code, ErrorCode::kInput);
    EXPECT_TRUE(set.error().message.starts_with(expected)) << set.error().message;
  }
}

TEST(ParseMtl, OddButHarmlessThingsAreWarnings) {
  const auto set =
      parse_mtl("Kd 1 1 1\nnewmtl a\nKd spectral x.rfl\nnewmtl a\nillum 2\nfoo\n", "a.mtl");
  ASSERT_TRUE(set);
  EXPECT_TRUE(any_contains(set->warnings, "a.mtl:1: 1 statements stand before the first newmtl"));
  EXPECT_TRUE(any_contains(set->warnings, "a.mtl:3: 1 colours are spectral"));
  EXPECT_TRUE(any_contains(set->warnings, "a.mtl:4: material \"a\" is defined twice"));
}

class Materials : public testing::Test {
 protected:
  std::string obj(const std::string& library, const std::string& material = "paint") const {
    return "mtllib " + library + "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl " +
           material + "\nf 1/1 2/2 3/3\n";
  }
  Result<LoadedModel> load(const std::string& text, bool strict = false) {
    return load_obj(folder_.write("sub/model.obj", text), {.strict = strict});
  }
  void write_texture(const std::string& name) {
    Image image = make_image(2, 1, {"R", "G", "B"});
    image.pixels = {1, 0, 0, 0, 1, 0};
    const auto png = encode_png(image);
    ASSERT_TRUE(png);
    folder_.write(name, *png);
  }
  TemporaryFolder folder_;
};

const char* const kPaint = "newmtl paint\nKd 0.25 0.5 0.75\n";

TEST_F(Materials, FindsTheMtlByItsWholeLineByWordsAndInAnyCase) {
  for (const char* name : {"my paint.mtl", "b.mtl"})
    folder_.write(std::string("sub/") + name, kPaint);
  folder_.write("sub/deep/c.mtl", kPaint);
  for (const char* library :
       {"my paint.mtl", "none.mtl b.mtl", "MY PAINT.MTL", "deep\\c.mtl", "Deep/C.mtl", "./b.mtl"}) {
    const auto loaded = load(obj(library));
    ASSERT_TRUE(loaded) << library << ": " << loaded.error().message;
    EXPECT_EQ(loaded->model.materials[0].color, (Vec3{0.25f, 0.5f, 0.75f})) << library;
  }
}

TEST_F(Materials, AMissingMtlIsAWarningOrWhenStrictAnError) {
  const auto loaded = load(obj("none.mtl"));
  ASSERT_TRUE(loaded);
  EXPECT_TRUE(any_contains(loaded->warnings, "model.obj:1: mtllib \"none.mtl\" is not there"));
  EXPECT_EQ(loaded->model.materials[0].color, Material{}.color);
  EXPECT_EQ(loaded->model.materials[0].name, "paint");
  const auto strict = load(obj("none.mtl"), true);
  ASSERT_FALSE(strict);
  EXPECT_EQ(strict.error().code, ErrorCode::kInput);
}

TEST_F(Materials, AnUnknownMaterialIsAWarning) {
  folder_.write("sub/a.mtl", kPaint);
  const auto loaded = load(obj("a.mtl", "varnish"));
  ASSERT_TRUE(loaded);
  EXPECT_TRUE(any_contains(loaded->warnings, "model.obj:8: material \"varnish\" is in no MTL"));
}

TEST_F(Materials, NothingOutsideTheFolderIsOpened) {
  folder_.write("secret.mtl", kPaint);
  for (const std::string& library :
       {std::string("../secret.mtl"), (folder_.path() / "secret.mtl").string(),
        std::string("deep/../../secret.mtl"), std::string("..\\secret.mtl"),
        std::string("C:\\secret.mtl")}) {
    const auto loaded = load(obj(library));
    ASSERT_FALSE(loaded) << library;
    EXPECT_EQ(loaded.error().code, ErrorCode::kInput);
    EXPECT_NE(loaded.error().message.find("model.obj:1: mtllib"), std::string::npos);
    EXPECT_NE(loaded.error().message.find("outside the model's folder"), std::string::npos)
        << loaded.error().message;
  }
  folder_.write("sub/secret.mtl", "newmtl paint\nKd 0 0 0\n");
  const auto beside = load(obj("../secret.mtl"));
  ASSERT_TRUE(beside);
  EXPECT_EQ(beside->model.materials[0].color, Vec3{});
  EXPECT_TRUE(any_contains(beside->warnings, "outside the model's folder"));
}

TEST_F(Materials, ReadsATextureWrittenTheWindowsWay) {
  write_texture("sub/Wood Grain.png");
  for (const char* name :
       {"Wood Grain.png", ".\\wood grain.PNG", "C:\\art\\WOOD GRAIN.png", "maps/Wood Grain.png"}) {
    folder_.write("sub/a.mtl", std::string(kPaint) + "map_Kd " + name + "\n");
    const auto loaded = load(obj("a.mtl"));
    ASSERT_TRUE(loaded) << name << ": " << loaded.error().message;
    ASSERT_EQ(loaded->model.textures.size(), 1u);
    EXPECT_EQ(loaded->model.materials[0].texture, 0);
    const TextureView texture = loaded->model.textures[0]->view();
    EXPECT_EQ(texture.width, 2);
    EXPECT_NEAR(texture.texel(1, 0).y, 1, 1e-3);
  }
}

TEST_F(Materials, AMissingOrBrokenTextureIsAWarningAndGrey) {
  folder_.write(
      "sub/a.mtl",
      "newmtl paint\nKd 1 1 1\nmap_Kd gone.tga\nnewmtl more\nmap_Kd broken.jpg\nnewmtl third\n"
      "map_Kd ../../outside.png\n");
  folder_.write("sub/broken.jpg", "this is no image");
  const std::string text =
      obj("a.mtl") + "v 0 0 2\nv 0 0 3\nusemtl more\nf 1/1 4/3 2/2\nusemtl third\nf 1/1 5/3 2/2\n";
  const auto loaded = load(text);
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_TRUE(any_contains(loaded->warnings, "a.mtl:3: map_Kd \"gone.tga\" is not there"));
  EXPECT_TRUE(any_contains(loaded->warnings, "broken.jpg: not an image that can be read"));
  EXPECT_TRUE(any_contains(loaded->warnings, "outside the model's folder and is not opened"));
  EXPECT_EQ(loaded->warnings.size(), 3u);
  for (const Material& material : loaded->model.materials) {
    EXPECT_EQ(material.texture, -1);
    EXPECT_EQ(material.color, Material{}.color);
  }
  const auto strict = load(text, true);
  ASSERT_FALSE(strict);
  for (const char* name : {"gone.tga", "broken.jpg", "outside.png"})
    EXPECT_NE(strict.error().message.find(name), std::string::npos) << strict.error().message;
}

TEST_F(Materials, AMissingOrBrokenTextureIsAStrictErrorWithTheMtlsLine) {
  folder_.write("sub/a.mtl", std::string(kPaint) + "map_Kd gone.png\n");
  const auto missing = load(obj("a.mtl"), true);
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::kInput);
  EXPECT_NE(missing.error().message.find("a.mtl:3: map_Kd \"gone.png\""), std::string::npos)
      << missing.error().message;
  for (const std::string& bytes :
       {std::string(), std::string("this is no image"), std::string("\x89PNG\r\n\x1a\nxx")}) {
    folder_.write("sub/gone.png", bytes);
    const auto broken = load(obj("a.mtl"), true);
    ASSERT_FALSE(broken);
    EXPECT_EQ(broken.error().code, ErrorCode::kInput);
    EXPECT_NE(broken.error().message.find("a.mtl:3: map_Kd"), std::string::npos)
        << broken.error().message;
    EXPECT_NE(broken.error().message.find("gone.png"), std::string::npos) << broken.error().message;
  }
}

TEST_F(Materials, UnusedMaterialsAreNeitherKeptNorTheirTexturesRead) {
  folder_.write("sub/a.mtl", std::string(kPaint) + "newmtl other\nmap_Kd gone.png\n");
  const auto loaded = load(obj("a.mtl"));
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->model.materials.size(), 1u);
}

TEST_F(Materials, OneTextureOfTwoMaterialsIsReadOnceAndScaleGoesToTheUvs) {
  write_texture("sub/t.png");
  folder_.write("sub/a.mtl",
                "newmtl paint\nmap_Kd t.png\nnewmtl more\nmap_Kd -s 2 4 1 -o 0.5 0 0 T.PNG\n");
  const auto loaded = load(obj("a.mtl") + "usemtl more\nf 1/1 3/3 2/2\n");
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->model.textures.size(), 1u);
  EXPECT_EQ(loaded->model.materials[1].texture, 0);
  EXPECT_EQ(loaded->model.corner_uvs[1], (Vec2{1, 0}));
  EXPECT_EQ(loaded->model.corner_uvs[4], (Vec2{0.5f, 4}));
}

TEST_F(Materials, WithoutUvsTheTextureIsNotUsed) {
  folder_.write("sub/a.mtl", "newmtl paint\nmap_Kd t.png\n");
  const auto loaded = load("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl paint\nf 1 2 3\n");
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->model.materials[0].texture, -1);
  EXPECT_TRUE(any_contains(loaded->warnings, "no texture coordinates"));
}

TEST(FindAsset, FollowsPathsBelowTheCurrentFolderToo) {
  const TemporaryFolder folder;
  folder.write("x.png", "x");
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  const auto here = AssetFinder("").find("", "X.png");
  const auto above = AssetFinder("").find("", "../x.jpg");
  std::filesystem::current_path(before);
  ASSERT_TRUE(here);
  EXPECT_EQ(here->path.filename(), "x.png");
  EXPECT_FALSE(above);
}

}  // namespace
}  // namespace polymorph
