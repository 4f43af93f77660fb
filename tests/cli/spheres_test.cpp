// The spheres subcommand.
#include "testing/program.h"

namespace polymorph {
namespace {

/// A unit square plate of the given thickness with an edge of open top where `open`.
std::string box_text(double height, bool open = false) {
  const std::string h = std::to_string(height);
  return "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv 0 " + h + " 0\nv 1 " + h + " 0\nv 1 " + h +
         " 1\nv 0 " + h + " 1\nf 1 2 3 4\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n" +
         (open ? "" : "f 5 8 7 6\n");
}

class SpheresCommand : public ProgramTest {};

TEST_F(SpheresCommand, TellsHowGoodTheBallsAre) {
  write("box.obj", box_text(0.5));
  const Ran ran = run(0, {"spheres", "box.obj", "--balls", "24"});
  EXPECT_TRUE(contains(ran.out, "box: 12 triangles, medial, ellipsoid balls fitted")) << ran.out;
  EXPECT_TRUE(contains(ran.out, "time for spheres and balls")) << ran.out;
  const auto json = parse(run(0, {"spheres", "box.obj", "--balls", "24", "--json"}).out);
  EXPECT_EQ(json["spheres"], 24);
  EXPECT_EQ(json["balls"], 24);
  EXPECT_GT(json["iou"].get<double>(), 0.95);
  EXPECT_LT(json["iou"].get<double>(), 1.0);
  EXPECT_NEAR(json["volume_ratio"].get<double>(), 1, 0.01);
  EXPECT_LT(json["rms_to_surface"].get<double>(), 0.01);
  EXPECT_LE(json["rms_to_surface"], json["hausdorff_to_surface"]);
  EXPECT_TRUE(json["problems"].empty()) << json;
  const auto unfitted =
      parse(run(0, {"spheres", "box.obj", "--balls", "24", "--no-fit", "--json"}).out);
  EXPECT_LT(unfitted["iou"], json["iou"]) << "what the fit is for";
}

TEST_F(SpheresCommand, NeedNotBeMeasured) {
  write("box.obj", box_text(0.5));
  const std::vector<std::string> command{"spheres",  "box.obj",      "--method",
                                         "octree",   "--resolution", "5",
                                         "--no-fit", "--json",       "--no-measure"};
  const auto plain = parse(run(0, command).out);
  const auto measured = parse(run(0, {command.begin(), command.end() - 1}).out);
  EXPECT_FALSE(plain.contains("iou")) << plain;
  EXPECT_TRUE(measured.contains("iou")) << measured;
  EXPECT_EQ(plain["spheres"], measured["spheres"]);
  EXPECT_EQ(plain["balls"], measured["balls"]) << "a ball for each sphere";
}

TEST_F(SpheresCommand, EveryMethodGivesATreeAndItsLeaves) {
  write("box.obj", box_text(0.5));
  for (const char* method : {"medial", "hubbard", "octree", "active"}) {
    const auto json = parse(run(0, {"spheres", "box.obj", "--method", method, "--balls", "12",
                                    "--resolution", "4", "--no-fit", "--json"})
                                .out);
    EXPECT_EQ(json["method"], method);
    EXPECT_GE(json["levels"].size(), 2u) << json;
    EXPECT_EQ(json["levels"][0], 1) << "one root";
    EXPECT_GT(json["iou"].get<double>(), 0.5) << json;
  }
}

TEST_F(SpheresCommand, AnErrorAsksForAsFewBallsAsKeepIt) {
  write("box.obj", box_text(0.5));
  const auto coarse =
      parse(run(0, {"spheres", "box.obj", "--error", "0.08", "--no-fit", "--json"}).out);
  const auto fine =
      parse(run(0, {"spheres", "box.obj", "--error", "0.04", "--no-fit", "--json"}).out);
  EXPECT_LT(coarse["spheres"], fine["spheres"]);
}

TEST_F(SpheresCommand, WritesBallsSpheresSurfaceAndPicture) {
  write("box.obj", box_text(0.5));
  const std::vector<std::string> command = {"spheres",
                                            "box.obj",
                                            "--balls",
                                            "8",
                                            "--grid",
                                            "32",
                                            "--write-balls",
                                            "balls.json",
                                            "-o",
                                            "p.png",
                                            "--width",
                                            "64",
                                            "--write-spheres",
                                            "spheres.obj",
                                            "--write-surface",
                                            "surface.ply"};
  run(0, command);
  EXPECT_EQ(parse(read_text(folder / "balls.json"))["balls"].size(), 8u);
  EXPECT_TRUE(read_text(folder / "surface.ply").starts_with("ply"));
  EXPECT_TRUE(contains(read_text(folder / "spheres.obj"), "\nf "));
  EXPECT_TRUE(exists("p.png"));
  run(0, {"spheres", "box.obj", "--balls", "8", "-q", "--write-balls", "balls.csv"});
  EXPECT_EQ(lines_of(read_text(folder / "balls.csv")).size(), 9u) << "a heading and 8 balls";
  run(0, {"spheres", "cube", "--method", "octree", "--resolution", "2", "--no-fit", "-q",
          "--write-spheres", "tree.json"});
  const auto tree = parse(read_text(folder / "tree.json"))["spheres"];
  ASSERT_EQ(tree.size(), 9u) << "the root and its eight leaves";
  EXPECT_EQ(tree[0]["leaf"], false);
  EXPECT_EQ(tree[8]["parent"], 0);
  EXPECT_EQ(tree[8]["leaf"], true);
  const Ran again = run(4, command);
  EXPECT_TRUE(contains(again.err, "--overwrite")) << again.err;
}

TEST_F(SpheresCommand, ThinAndBrokenModelsAreNamedWithARemedy) {
  write("plane.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n");
  const Ran flat = run(0, {"spheres", "plane.obj", "--balls", "32", "--json"});
  EXPECT_TRUE(contains(flat.err, "it is flat")) << flat.err;
  EXPECT_TRUE(contains(flat.err, "taken for a shell and given thickness")) << flat.err;
  EXPECT_GT(parse(flat.out)["iou"].get<double>(), 0.7) << flat.out;

  write("open.obj", box_text(0.5, true));
  const Ran open = run(0, {"spheres", "open.obj", "--balls", "16"});
  EXPECT_TRUE(contains(open.err, "4 edges have only one face, in 1 of 1 shells, first from "))
      << open.err;
  EXPECT_TRUE(contains(open.err, "--solidify fills it")) << open.err;
  const auto solid =
      parse(run(0, {"spheres", "open.obj", "--balls", "16", "--solidify", "--json"}).out);
  EXPECT_GT(solid["volume_ratio"].get<double>(), 0.5) << "a box, not its walls";

  write("thin.obj", box_text(0.01));
  const auto thin = parse(run(0, {"spheres", "thin.obj", "--balls", "64", "--json"}).out);
  EXPECT_TRUE(contains(thin["problems"].dump(), "it is thin: half of its walls are thinner than"))
      << thin;
  EXPECT_GT(thin["iou"].get<double>(), 0.7) << "stretched balls lie flat in the plate";
}

TEST_F(SpheresCommand, ContradictionsAreUsageErrors) {
  write("box.obj", box_text(0.5));
  EXPECT_TRUE(contains(run(2, {"spheres", "box.obj", "--method", "medail"}).err, "medial"));
  EXPECT_TRUE(contains(run(2, {"spheres", "box.obj", "--write-surface", "x.stl"}).err, ".ply"));
  run(2, {"spheres", "box.obj", "--balls", "0"});
  run(3, {"spheres", "none.obj"});
}

}  // namespace
}  // namespace polymorph
