// Sequences of meshes in place of a scene: all formats, and the commands that render, test, convert
// and describe scenes.
#include <cmath>

#include "testing/program.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

class MeshSequences : public ProgramTest {
 protected:
  /// Open pyramids over 4, 5, 6, ... sides, each with the points of those before it.
  void write_meshes(int count) const {
    for (int n = 1; n <= count; ++n) write_mesh(n, 3 + n);
  }
  void write_mesh(int number, int sides) const {
    std::string text = "v 0 1 0\n";
    for (int i = 0; i < sides; ++i)
      text += "v " + std::to_string(i) + " 0 " + std::to_string(i * i % 7) + "\n";
    for (int i = 0; i < sides; ++i)
      text += "f 1 " + std::to_string(2 + i) + " " + std::to_string(2 + (i + 1) % sides) + "\n";
    write(name_of(number), text);
  }
  static std::string name_of(int number) { return "m.000" + std::to_string(number) + ".obj"; }
  Ran render(int code, std::vector<std::string> more) {
    std::vector<std::string> words{"render", "m.####.obj", "-o", "f.####.png"};
    words.insert(words.end(), kSmall.begin(), kSmall.end());
    words.insert(words.end(), more.begin(), more.end());
    return run(code, words);
  }
  const std::vector<std::string> kSmall{"--set",           "image.width=32", "--set",
                                        "image.height=24", "--spp",          "1"};
};

TEST_F(MeshSequences, AllFormatsRenderInOneLine) {
  for (const char* suffix : {".obj", ".ply", ".stl", ".off", ".glb"}) {
    for (const int n : {7, 8}) {
      const fs::path box = source_dir() / "tests/data/models" / ("box" + std::string(suffix));
      const std::string name = "box_0" + std::to_string(n) + suffix;
      if (fs::exists(box))
        fs::copy_file(box, folder / name);
      else
        write(name, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
    }
    std::vector<std::string> words{"render", "box_##" + std::string(suffix), "-o",
                                   "out" + std::string(suffix) + "/f.####.png"};
    words.insert(words.end(), kSmall.begin(), kSmall.end());
    const Ran ran = run(0, words);
    EXPECT_TRUE(contains(ran.err, "2 frames rendered")) << ran.err;
    EXPECT_EQ(read_text(folder / ("out" + std::string(suffix)) / "f.0001.png").substr(1, 3), "PNG");
  }
}

TEST_F(MeshSequences, CompareMeasuresHowFarSurfacesAreApart) {
  const auto tetrahedron = [&](const std::string& name, const std::string& top) {
    write(name,
          "v 0 0 0\nv 3 0 0\nv 0 3 0\nv 0 0 " + top + "\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
  };
  tetrahedron("a.01.obj", "3"), tetrahedron("a.02.obj", "3");
  tetrahedron("b.01.obj", "3"), tetrahedron("b.02.obj", "3.6");
  const Ran ran = run(1, {"compare", "a.##.obj", "b.##.obj", "--fail", "0.05"});
  EXPECT_TRUE(contains(ran.out, "a.01.obj: same points and faces")) << ran.out;
  EXPECT_TRUE(contains(ran.out, "a.02.obj: different: at most ")) << ran.out;
  EXPECT_TRUE(contains(ran.out, "1 of 2 pairs pass")) << ran.out;
  run(0, {"compare", "a.##.obj", "b.##.obj", "--fail", "0.2"});
  const auto json = parse(run(1, {"compare", "a.02.obj", "b.02.obj", "--json"}).out);
  // 0.6 of a diagonal of sqrt(3^2 + 3^2 + 3.6^2), at the top; less between the other points.
  const double largest = json["cases"][0]["largest"].get<double>();
  EXPECT_NEAR(largest, 0.6 / std::sqrt(30.96), 0.02);
  EXPECT_LT(json["cases"][0]["mean"].get<double>(), 0.5 * largest);
  fs::remove(folder / "a.02.obj");
  EXPECT_TRUE(contains(run(3, {"compare", "a.##.obj", "b.##.obj"}).err, "a.02.obj"));
  EXPECT_TRUE(contains(run(2, {"compare", "a.01.obj", "b.##.obj"}).err, "two sequences"));
  EXPECT_TRUE(contains(run(2, {"compare", "a.01.obj", "b.01.obj", "--html", "r.html"}).err,
                       "are for images"));
}

TEST_F(MeshSequences, EveryCommandTakesThePattern) {
  write_meshes(3);
  EXPECT_TRUE(contains(run(0, {"check", "m.####.obj"}).out, "m: 3 meshes, frames 1 to 3, at most"));
  EXPECT_TRUE(contains(run(0, {"info", "m.####.obj"}).out, "3 meshes, frames 1 to 3"));
  EXPECT_TRUE(contains(run(0, {"info", "m.####.obj", "--timeline"}).out, "m 2 "));
  render(0, {});
  std::vector<std::string> status{"status", "f.####.png", "m.####.obj"};
  status.insert(status.end(), kSmall.begin(), kSmall.end());
  EXPECT_TRUE(contains(run(0, status).out, "  1-3\n"));
  write_mesh(2, 3);  // within the box around all
  EXPECT_TRUE(contains(run(1, status).out, "  1,3\n"));
  EXPECT_TRUE(contains(render(0, {"--skip-existing"}).err, "1 frame rendered, 2 kept"));
  std::vector<std::string> strip{"strip", "m.####.obj", "-o", "s.png", "--gif", "s.gif"};
  strip.insert(strip.end(), kSmall.begin(), kSmall.end());
  run(0, strip);
  EXPECT_EQ(read_text(folder / "s.gif").substr(0, 3), "GIF");
  render(0, {"--turntable", "--overwrite"});
  run(0, {"mesh", "m.####.obj", "-o", "out.####.ply"});
  EXPECT_TRUE(contains(read_text(folder / "out.0003.ply"), "element face 6\n"));
  EXPECT_TRUE(contains(run(2, {"strip", "m.####.obj", "--html", "page.txt"}).err, ".html"));
  EXPECT_TRUE(
      contains(run(3, {"strip", "m.####.obj", "--html", "page.html"}).err, "has a mesh sequence"));
}

TEST_F(MeshSequences, WhatIsMissingIsNamedAndTheOthersAreMade) {
  write_meshes(4);
  fs::remove(folder / name_of(3));
  EXPECT_TRUE(contains(render(3, {}).err, "mesh 3: "));
  EXPECT_FALSE(fs::exists(folder / "f.0001.png"));
  const Ran on = render(6, {"--keep-going"});
  EXPECT_TRUE(contains(on.err, "m.0003.obj: no such file")) << on.err;
  EXPECT_TRUE(contains(on.err, "3 frames rendered, 1 failed")) << on.err;
  EXPECT_TRUE(contains(run(1, {"check", "m.####.obj"}).out, "4 meshes, frames 1 to 4, 1 missing"));
  write_mesh(3, 6);
  EXPECT_TRUE(contains(render(0, {"--skip-existing"}).err, "1 frame rendered, 3 kept"));
}

TEST_F(MeshSequences, WarningsOfTheFirstMeshStandForThoseOfTheOthers) {
  for (int number = 1; number <= 3; ++number)
    write("warn.000" + std::to_string(number) + ".obj",
          "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\nl 1 2\n");
  const std::string warnings = run(0, {"check", "warn.####.obj"}).err;
  EXPECT_TRUE(contains(warnings, "warn.0001.obj:9: ")) << warnings;
  EXPECT_FALSE(contains(warnings, "warn.0002.obj")) << warnings;
  EXPECT_TRUE(contains(warnings, "2 more meshes have warnings of their own")) << warnings;
}

TEST_F(MeshSequences, StoredVelocitiesBlur) {
  const auto write_cloud = [&](int number, int faces) {
    std::string text =
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        "property float z\nproperty float vx\nproperty float vy\nproperty float vz\n"
        "element face " +
        std::to_string(faces) +
        "\nproperty list uchar int vertex_indices\nend_header\n"
        "0 0 0 12 0 0\n1 0 0 12 0 0\n0 1 0 12 0 0\n0 0 1 12 0 0\n3 0 2 1\n3 0 1 3\n";
    if (faces > 2) text += "3 1 2 3\n";
    write("c.0" + std::to_string(number) + ".ply", text);
  };
  write_cloud(1, 3);
  write_cloud(2, 2);
  const auto render_cloud = [&](const std::string& output, const std::string& shutter) {
    std::vector<std::string> line{"render", "c.##.ply", "-f", "1", "-o", output, "--set", shutter};
    line.insert(line.end(), kSmall.begin(), kSmall.end());
    return run(0, line);
  };
  render_cloud("still.png", "camera.shutter=0");
  const Ran blurred = render_cloud("blurred.png", "camera.shutter=1");
  EXPECT_FALSE(contains(blurred.err, "no motion blur")) << blurred.err;
  EXPECT_NE(read_text(folder / "still.png"), read_text(folder / "blurred.png"));
  EXPECT_EQ(run(1, {"compare", "still.png", "blurred.png"}).code, 1) << "not only the header";
}

TEST_F(MeshSequences, AGoldenSuiteKnowsItsMeshes) {
  write_meshes(3);
  write("scenes/m.json", R"({"source": "../m.####.obj",
      "image": {"width": 32, "height": 24, "samples": 1}})");
  write("golden_frames/m/suite.json", R"({"scene": "../../scenes/m.json", "frames": [1, 3]})");
  run(0, {"golden", "update", "m", "--reason", "first"});
  run(0, {"golden", "test"});
  write_mesh(3, 9);
  const Ran changed = run(1, {"golden", "test"});
  EXPECT_TRUE(contains(changed.out + changed.err, "frame 3: FAILED")) << changed.out << changed.err;
}

}  // namespace
}  // namespace polymorph
