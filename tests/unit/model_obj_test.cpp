#include <gtest/gtest.h>
#include <sys/stat.h>

#include <set>

#include "base/file.h"
#include "mesh/normals.h"
#include "model/load/load_obj.h"
#include "model/repair/diagnose.h"
#include "testing/model.h"

namespace polymorph {
namespace {

class LoadObj : public testing::Test {
 protected:
  Result<LoadedModel> load(std::string_view text) {
    return load_obj(folder_.write("model.obj", text), {.textures = false});
  }
  Model good(std::string_view text) {
    auto loaded = load(text);
    EXPECT_TRUE(loaded) << (loaded ? "" : loaded.error().message);
    if (!loaded) return {};
    warnings_ = loaded->warnings;
    return loaded->model;
  }
  std::string error(std::string_view text) {
    const auto loaded = load(text);
    EXPECT_FALSE(loaded) << "accepted: " << text.substr(0, 80);
    if (loaded) return "";
    EXPECT_EQ(loaded.error().code, ErrorCode::kInput);
    return loaded.error().message;
  }
  TemporaryFolder folder_;
  std::vector<std::string> warnings_;
};

const std::string kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

TEST_F(LoadObj, KeepsTheFilesVerticesWhereAsked) {
  // Two in one place, and one that no face uses.
  const auto file =
      folder_.write("model.obj", "v 9 9 9\n" + kTriangle + "v 0 0 0\nf 2 3 4\nf 5 4 3\n");
  const auto loaded = load_obj(file, {.textures = false, .vertices = true});
  ASSERT_TRUE(loaded);
  EXPECT_EQ(loaded->vertices,
            (std::vector<Vec3>{{9, 9, 9}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}}));
  EXPECT_EQ(loaded->model.points.size(), 3u);
  EXPECT_TRUE(load_obj(file, {.textures = false})->vertices.empty());
}

TEST_F(LoadObj, OfEqualFacesOneIsKept) {
  // The reverse of a face is none of its equals; a turned list of its corners is.
  const Model model = good(kTriangle + "g a\nf 1 2 3\nf 1 3 2\ng b\nf 2 3 1\nf 1 2 3\n");
  EXPECT_EQ(model.triangles.size(), 2u);
  EXPECT_EQ(model.label_names, std::vector<std::string>{"a"});
  EXPECT_TRUE(any_contains(warnings_, "2 triangles are there more than once"));
}

TEST_F(LoadObj, ACommentMayFollowAFaceAtOnce) {
  EXPECT_EQ(good(kTriangle + "f 1 2 3# end\n").triangles.size(), 1u);
  EXPECT_EQ(good(kTriangle + "f 1 2 3 # end\nf 3 2 1#\n").triangles.size(), 2u);
}

TEST_F(LoadObj, BadInputIsAnErrorWithLineAndReason) {
  const struct {
    std::string text;
    std::vector<const char*> expected;
  } cases[] = {
      {"", {"no faces"}},
      {"v 0 0 0\nv 1 0 0\n", {"no faces", "2 vertices"}},
      {"hello world\nthis is prose\n", {":1: no faces", "Wavefront OBJ"}},
      {kTriangle + "f 1 2\n", {":4: no faces", "fewer than 3"}},
      {kTriangle + "f 1 2 2\n", {"no faces", "no area"}},
      {kTriangle + "v 2 0 0\nf 1 2 4\n", {"no faces", "no area"}},
      {"v 1e9 1e9 1e9\nv 1000000001 1e9 1e9\nv 1e9 1000000001 1e9\nf 1 2 3\n",
       {"no area", "1e+09 from the origin", "move the model to the origin"}},
      {"cstype bezier\nsurf 0 1 0 1 1 2 3\n", {"free-form"}},
      {std::string("v 0 0 0\0\n", 9), {"not text", "0x00", "offset 7"}},
      {"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", {":1: vertex number 3 \"nan\"", "finite"}},
      {"v 0 0 0\nv inf 0 0\nv 0 1 0\nf 1 2 3\n", {":2: vertex number 1 \"inf\"", "finite"}},
      {"v 1e999 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", {":1:", "too large"}},
      {"v -1.#IND 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", {":1:", "\"-1.#IND\"", "finite"}},
      {"v 0,5 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", {":1:", "decimal comma"}},
      {"v a b c\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", {":1: vertex number 1 \"a\" is not a number"}},
      {"v 1 2\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", {":1: vertex has 2 of 3 numbers"}},
      {"v\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", {":1: vertex has 0 of 3"}},
      {"v 1 2 3 4 5 6 7 8 9\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", {":1: vertex has more than 8"}},
      {kTriangle + "vn 0 0 x\nf 1 2 3\n", {":4: normal number 3"}},
      {kTriangle + "vn 0 0\nf 1 2 3\n", {":4: normal has 2 of 3"}},
      {kTriangle + "vt nan 0\nf 1 2 3\n", {":4: texture coordinate number 1"}},
      {kTriangle + "f 0 1 2\n", {":4: vertex index 0", "counts from 1"}},
      {kTriangle + "f 1 2 4\n", {":4: vertex index 4 is beyond the 3"}},
      {kTriangle + "f 1 2 -4\n", {":4: relative vertex index -4 reaches before the start"}},
      {kTriangle + "f 1 2 99999999999\n", {":4: vertex index 99999999999", "32-bit"}},
      {kTriangle + "f 1 2 99999999999999999999999\n", {":4:", "32-bit"}},
      {kTriangle + "f 1 2 #3\n", {"no faces"}},
      {kTriangle + "f 1/1 2/1 3/1\n", {":4: texture coordinate index 1 is beyond the 0"}},
      {kTriangle + "vn 0 0 1\nf 1//1 2//1 3//2\n", {":5: normal index 2 is beyond the 1"}},
      {kTriangle + "f 1//-1 2//-1 3//-1\n", {":4: relative normal index -1"}},
      {kTriangle + "f 1 2 x\n", {":4: vertex index \"x\" is not a whole number"}},
      {kTriangle + "f 1 2 3.5\n", {":4:", "whole number"}},
      {kTriangle + "f 1 2 3/1/1/1\n", {":4:", "more than three indices"}},
      {kTriangle + "f /1 2 3\n", {":4:", "whole number"}},
  };
  for (const auto& c : cases) {
    const std::string message = error(c.text);
    EXPECT_TRUE(message.starts_with((folder_.path() / "model.obj").string())) << message;
    for (const char* part : c.expected)
      EXPECT_NE(message.find(part), std::string::npos)
          << "wanted: " << part << "\ngot: " << message;
  }
}

TEST_F(LoadObj, CollectsUpToTwentyErrors) {
  const std::string message = error("v 0 0 x\nv 1 0 0\nv 0 1 0\nf 1 2 9\nf 0 1 2\n");
  EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 2) << message;
  EXPECT_LT(message.find(":1:"), message.find(":4:"));
  EXPECT_LT(message.find(":4:"), message.find(":5:"));
  std::string many;
  for (int i = 0; i < 1000; ++i) many += "v nan 0 0\n";
  EXPECT_NE(error(many).find("stopped after 20 errors"), std::string::npos);
}

TEST_F(LoadObj, FacesOfMoreThan4096CornersAreRefusedQuickly) {
  std::string text = kTriangle + "f";
  for (int i = 0; i < 2000000; ++i) text += " 1 2 3" + std::string(i % 2 ? " 1" : "");
  EXPECT_NE(error(text).find(":4: face has more than 4096 corners"), std::string::npos);
}

TEST_F(LoadObj, FilesThatAreNoTextFiles) {
  EXPECT_NE(error(std::string("v\0 \0"
                              "1\0 \0"
                              "2\0 \0"
                              "3\0\n\0",
                              16))
                .find("UTF-16"),
            std::string::npos);
  EXPECT_NE(error("ply\nformat ascii 1.0\n").find("PLY"), std::string::npos);
  const auto directory = load_obj(folder_.path());
  ASSERT_FALSE(directory);
  EXPECT_EQ(directory.error().code, ErrorCode::kInput);
  EXPECT_NE(directory.error().message.find("directory"), std::string::npos);
  const auto missing = load_obj(folder_.path() / "none.obj");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::kInput);
  EXPECT_NE(missing.error().message.find("none.obj"), std::string::npos);
  const std::filesystem::path fifo = folder_.path() / "fifo.obj";
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  const auto pipe = load_obj(fifo);
  ASSERT_FALSE(pipe);
  EXPECT_NE(pipe.error().message.find("regular file"), std::string::npos);
  const auto large = load_obj(folder_.write("large.obj", std::string(100, '#')), {.max_bytes = 99});
  ASSERT_FALSE(large);
  EXPECT_NE(large.error().message.find("too large"), std::string::npos);
}

TEST_F(LoadObj, AcceptsBomLineEndsTabsCommentsAndContinuation) {
  for (const char* text :
       {"\xef\xbb\xbfv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3",
        "v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3\r\n", "v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3",
        "v\t0\t0  0 \nv +1 .0 -0\nv 0 1. 1e-046 # up\n\n  f  1\t2 3 \n",
        "# a\\\nv 0 0 0\nv 1 \\\n 0 0\nv 0 1 0\nf 1 \\\n2 \\\n3\n"}) {
    const Model model = good(text);
    ASSERT_EQ(model.triangles.size(), 1u) << text;
    ASSERT_EQ(model.points.size(), 3u) << text;
    EXPECT_EQ(model.points[1], (Vec3{1, 0, 0})) << text;
    EXPECT_EQ(model.points[2], (Vec3{0, 1, 0})) << text;
    EXPECT_TRUE(warnings_.empty()) << warnings_[0];
  }
}

TEST_F(LoadObj, ZeroNormalAndUvIndicesAreDroppedWithAWarning) {
  const Model model = good(kTriangle + "f 1/0/0 2/0/0 3/0/0\n");
  EXPECT_EQ(model.triangles.size(), 1u);
  EXPECT_TRUE(model.corner_uvs.empty());
  EXPECT_TRUE(any_contains(warnings_, ":4: 3 normal indices are 0"));
  EXPECT_TRUE(any_contains(warnings_, ":4: 3 texture coordinate indices are 0"));
}

TEST_F(LoadObj, RelativeIndicesAndFacesBeforeVertices) {
  EXPECT_EQ(good("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 1\nf -4 -1 -2\n").triangles.size(),
            2u);
  EXPECT_EQ(good("f 1 2 3\n" + kTriangle).triangles.size(), 1u);
}

TEST_F(LoadObj, DegenerateFacesAreDroppedWithTheirLine) {
  const Model model =
      good(kTriangle + "v 2 0 0\nf 1 2 3\nf 1 2\nf 1 1 2\nf 1 2 4\nl 1 2\np 1\nl 2 3\n");
  EXPECT_EQ(model.triangles.size(), 1u);
  EXPECT_EQ(model.points.size(), 3u) << "points that only dropped faces use are not kept";
  EXPECT_TRUE(any_contains(warnings_, ":6: 1 face with fewer than 3 corners")) << warnings_[0];
  EXPECT_TRUE(any_contains(warnings_, ":7: 2 faces have no area"));
  EXPECT_TRUE(any_contains(warnings_, ":9: 3 line or point elements"));
}

TEST_F(LoadObj, RepeatedCornersAreMergedSoThatNoHoleOpens) {
  const Model model =
      good("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2 2\nf 1 2 4 1\nf 2 3 3 4\nf 3 1 4 4\n");
  EXPECT_TRUE(diagnose(model).closed);
  EXPECT_EQ(model.triangles.size(), 4u);
  EXPECT_TRUE(any_contains(warnings_, "4 faces repeat a corner"));
}

TEST_F(LoadObj, ASeamTriangleWithoutAreaStaysWhereItClosesTheModel) {
  // A tetrahedron one of whose faces is split at the middle (5) of edge 1-2, the other side is not:
  // 1-2-5 closes it.
  const Model model = good(
      "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 0 0 2\nv 1 0 0\n"
      "f 1 3 5\nf 5 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\nf 1 5 2\n");
  EXPECT_TRUE(diagnose(model).closed);
  EXPECT_EQ(model.triangles.size(), 6u);
  EXPECT_TRUE(warnings_.empty());
}

TEST_F(LoadObj, FacesWithoutAreaGoAsFarAsTheyLeaveEachOtherAlone) {
  // A tube all on one line, open at both ends: each ring that goes leaves the next one alone. Only
  // with work in proportion to the faces does this end.
  constexpr int kRings = 20000;
  std::string text = kTriangle;
  for (int i = 0; i < 3 * (kRings + 1); ++i) text += fmt::format("v {} 0 0\n", i + 2);
  for (int ring = 0; ring < kRings; ++ring)
    for (int k = 0; k < 3; ++k) {
      const int a = 4 + 3 * ring + k, b = 4 + 3 * ring + (k + 1) % 3;
      text += fmt::format("f {} {} {}\nf {} {} {}\n", a, b, b + 3, a, b + 3, a + 3);
    }
  const Model model = good(text + "f 1 2 3\n");
  EXPECT_EQ(model.triangles.size(), 1u);
  EXPECT_EQ(model.points.size(), 3u);
  EXPECT_TRUE(any_contains(warnings_, fmt::format("{} faces have no area", 6 * kRings)));
}

TEST_F(LoadObj, WeldsPointsByPosition) {
  // Three corners at (1, 0, 0), written differently.
  const Model model = good(
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1.000 -0 0\nv 0 1 0\nv 1 1 0\nv 9 9 9\nf 1 2 3\nf 4 6 5\n");
  EXPECT_EQ(model.points.size(), 4u);
  EXPECT_EQ(diagnose(model).boundary_edges, 4u);
  const auto loaded = load("v 0 0 0\nv 0 0 0\n" + kTriangle + "f 3 4 5\n");
  EXPECT_EQ(loaded->file_points, 5u);
}

TEST_F(LoadObj, ConcavePolygonsKeepTheirShape) {
  // The U of tinyobjloader issue 319: its fan would cover the gap.
  const Model model = good(
      "v 0 0 0\nv 3 0 0\nv 3 3 0\nv 2 3 0\nv 2 1 0\nv 1 1 0\nv 1 3 0\nv 0 3 0\nf 1 2 3 4 5 6 7 "
      "8\n");
  EXPECT_EQ(model.triangles.size(), 6u);
  EXPECT_NEAR(area_of(model), 7, 1e-6);
  for (const Vec3 n : face_normals(model)) EXPECT_GT(n.z, 0.99f);
}

TEST_F(LoadObj, PolygonsOfMoreThan255CornersKeepTheirSize) {
  std::string text, face = "f";
  for (int i = 0; i < 600; ++i) {
    text += fmt::format("v {} {} 0\n", std::cos(i * 2 * M_PI / 600), std::sin(i * 2 * M_PI / 600));
    face += fmt::format(" {}", i + 1);
  }
  const Model model = good(text + face + "\n");
  EXPECT_EQ(model.triangles.size(), 598u);
  EXPECT_NEAR(area_of(model), M_PI, 1e-3);
}

TEST_F(LoadObj, CubesStaySharpAndCurvesGetSmooth) {
  const Model cube = good(kCubeObj);
  const std::vector<Vec3> faces = face_normals(cube);
  for (std::size_t c = 0; c < cube.corner_normals.size(); ++c)
    EXPECT_EQ(cube.corner_normals[c], faces[c / 3]);
  std::string text;
  for (int i = 0; i < 12; ++i)
    for (int z = 0; z < 2; ++z)
      text += fmt::format("v {} {} {}\n", std::cos(i * M_PI / 6), std::sin(i * M_PI / 6), z);
  for (int i = 0; i < 12; ++i) {
    const int a = 2 * i + 1, b = 2 * ((i + 1) % 12) + 1;
    text += fmt::format("f {} {} {} {}\n", a, b, b + 1, a + 1);
  }
  const Model tube = good(text);
  for (std::size_t c = 0; c < tube.corner_normals.size(); ++c) {
    const Vec3 p = tube.points[tube.triangles[c / 3].v[c % 3]];
    EXPECT_NEAR(dot(tube.corner_normals[c], {p.x, p.y, 0}), 1, 1e-5);
  }
}

TEST_F(LoadObj, NormalsOfTheFileAreUsedWhereTheyAreGiven) {
  const Model model =
      good(kTriangle + "v 1 1 0\nvn 0 3 4\nvn 0 0 0\nf 1//1 2//1 3//1\nf 2//1 4//2 3//1\n");
  EXPECT_NEAR(model.corner_normals[0].y, 0.6, 1e-6);
  EXPECT_NEAR(model.corner_normals[0].z, 0.8, 1e-6);
  EXPECT_EQ(model.corner_normals[3], (Vec3{0, 0, 1})) << "a zero normal counts as missing";
}

TEST_F(LoadObj, UvsAreKeptPerCorner) {
  const Model model =
      good(kTriangle + "v 1 1 0\nvt 0 0\nvt 1 0.25\nvt 0.5\nf 1/1 2/2 3/3\nf 2 4 3\n");
  ASSERT_EQ(model.corner_uvs.size(), 6u);
  EXPECT_EQ(model.corner_uvs[1], (Vec2{1, 0.25f}));
  EXPECT_EQ(model.corner_uvs[2], (Vec2{0.5f, 0}));
  EXPECT_EQ(model.corner_uvs[3], (Vec2{0, 0}));
}

TEST_F(LoadObj, LabelsAreGroupsOrElseObjects) {
  const Model model = good(
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\no Body\nf 1 2 4\ng head ear.L\nf 1 3 4\ng "
      "unused\n"
      "o Tail\nf 2 3 4\ng\nf 2 4 3\ng head ear.L\nf 4 3 1\n");
  const std::vector<std::string> names{"default", "Body", "head ear.L", "Tail"};
  const std::vector<std::uint32_t> labels{0, 1, 2, 3, 3, 2};
  EXPECT_EQ(model.label_names, names);
  EXPECT_EQ(model.labels, labels);
  EXPECT_EQ(model.name, "model");
}

TEST_F(LoadObj, AnInsideOutModelIsTurnedAndKeepsGoodNormals) {
  const std::string inverted =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n"
      "vn -1 0 0\nvt 0.25 0.5\nf 1/1/1 3/1/1 7/1/1 5/1/1\nf 2 6 8 4\nf 1 5 6 2\nf 3 4 8 7\nf 1 2 4 "
      "3\nf 5 7 8 6\n";
  const Model model = good(inverted);
  EXPECT_TRUE(any_contains(warnings_, "inside out"));
  EXPECT_NEAR(volume_of(model), 1, 1e-6);
  const std::vector<Vec3> faces = face_normals(model);
  EXPECT_EQ(faces[0], (Vec3{-1, 0, 0}));
}

TEST_F(LoadObj, FacesThatLookTheWrongWayAreTurnedAndTold) {
  std::string text = kCubeObj;
  const std::string right = "f 1 5 7 3\n";
  text.replace(text.find(right), right.size(), "f 3 7 5 1\n");
  const Model model = good(text);
  EXPECT_TRUE(any_contains(warnings_, ": 2 of 12 faces point inwards - flipped")) << "triangles";
  EXPECT_NEAR(volume_of(model), 1, 1e-6);
  const std::vector<Vec3> faces = face_normals(model);
  for (std::size_t c = 0; c < model.corner_normals.size(); ++c)
    EXPECT_GT(dot(model.corner_normals[c], faces[c / 3]), 0.99f) << c;
  EXPECT_EQ(good(kCubeObj).triangles.size(), 12u);
  EXPECT_FALSE(any_contains(warnings_, "point inwards"));
}

TEST_F(LoadObj, FarFromTheOriginIsAWarning) {
  good("v 1000000 0 0\nv 1000001 0 0\nv 1000000 1 0\nf 1 2 3\n");
  EXPECT_TRUE(any_contains(warnings_, "away from the origin"));
}

TEST_F(LoadObj, UnknownWordsAreIgnoredAndTold) {
  EXPECT_EQ(good("v 0 0 0 1 2\nv 1 0 0\nv 0 1 0\nf 1 2 3\nfoo bar\n").triangles.size(), 1u);
  EXPECT_TRUE(any_contains(warnings_, ":1: 1 vertex with 5 or 8 numbers"));
  EXPECT_TRUE(any_contains(warnings_, ":5: 1 line starts with an unknown word"));
}

TEST_F(LoadObj, ColoursOfPointsBecomeMaterialsOfFaces) {
  // As scanners write them, in sRGB; one face has a point without a colour, one an alpha beside.
  const Model model = good(
      "v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0 0.5\nv 0 0 1\n"
      "f 1 2 3\nf 1 3 4\n");
  EXPECT_TRUE(warnings_.empty()) << warnings_.front();
  ASSERT_EQ(model.triangle_materials.size(), 2u);
  const auto material = [&](std::size_t t) { return model.materials[model.triangle_materials[t]]; };
  EXPECT_EQ(material(0).color, (Vec3{1, 0, 0}));
  EXPECT_EQ(material(0).name, "color_ff0000");
  EXPECT_EQ(material(1).color, Material{}.color);
  // The mean of the corners; 0.5 of sRGB is 128 of 255, and 0.216 of linear light.
  const Model grey = good("v 0 0 0 0 0 0\nv 1 0 0 0.5 0.5 0.5\nv 0 1 0 1 1 1\nf 1 2 3\n");
  EXPECT_NEAR(grey.materials[0].color.x, 0.216f, 0.001f);
  // White says nothing; a texture says more.
  EXPECT_EQ(good("v 0 0 0 1 1 1\nv 1 0 0 1 1 1\nv 0 1 0 1 1 1\nf 1 2 3\n").materials[0].color,
            Material{}.color);
  folder_.write("m.mtl", "newmtl print\nmap_Kd print.png\nnewmtl shiny\nKd 0 0 1\nPr 0.25\n");
  const Model dressed = good(
      "mtllib m.mtl\nv 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nv 0 0 1 1 0 0\n"
      "usemtl print\nf 1 2 3\nusemtl shiny\nf 1 3 4\n");
  EXPECT_EQ(dressed.materials[dressed.triangle_materials[0]].name, "print");
  const Material& shiny = dressed.materials[dressed.triangle_materials[1]];
  EXPECT_EQ(shiny.color, (Vec3{1, 0, 0}));
  EXPECT_EQ(shiny.roughness, 0.25f) << "the rest of the material stays";
}

}  // namespace
}  // namespace polymorph
