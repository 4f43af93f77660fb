#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "base/file.h"
#include "compare/golden.h"
#include "testing/temporary_folder.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

class Golden : public FolderTest {
 protected:
  void put(const std::string& file, const std::string& text) const {
    fs::create_directories((folder / file).parent_path());
    std::ofstream(folder / file) << text;
  }
  /// The error of loading suite "a"; it must be bad input.
  std::string failure() const {
    const auto suite = load_golden_suite(folder, "a");
    EXPECT_FALSE(suite);
    if (suite) return "";
    EXPECT_EQ(suite.error().code, ErrorCode::kInput);
    return suite.error().message;
  }
  void expect_failure(const std::string& suite, const std::string& part) const {
    put("a/suite.json", suite);
    const std::string message = failure();
    EXPECT_NE(message.find(part), std::string::npos) << message;
    EXPECT_EQ(message.find((folder / "a/suite.json").string()), 0u) << message;
  }
  void expect_limit_failure(const std::string& limits, const std::string& part) const {
    put("a/suite.json", R"({"scene": "s.json", "frames": [1]})");
    put("a/tolerance.json", limits);
    const std::string message = failure();
    EXPECT_NE(message.find(part), std::string::npos) << message;
    EXPECT_EQ(message.find((folder / "a/tolerance.json").string()), 0u) << message;
  }
};

TEST_F(Golden, ReadsASuiteAndItsLimits) {
  put("golden/a/suite.json", R"({"scene": "../../scenes/x/scene.json", "frames": [1, 12, 24]})");
  put("golden/a/tolerance.json",
      R"({"fail": {"value": 0.01, "why": "isa"}, "hard_fail": {"value": 0.25, "why": "fireflies"}})");
  const auto suite = load_golden_suite(folder / "golden", "a");
  ASSERT_TRUE(suite) << suite.error().message;
  EXPECT_EQ(suite->name, "a");
  EXPECT_EQ(suite->scene, folder / "scenes/x/scene.json");
  EXPECT_EQ(suite->frames, (std::vector<int>{1, 12, 24}));
  EXPECT_EQ(suite->tolerance.fail, 0.01f);
  EXPECT_EQ(suite->tolerance.hard_fail, 0.25f);
  EXPECT_EQ(suite->tolerance.relative, 0) << "nothing of our own frames may differ";
  EXPECT_EQ(suite->tolerance.why, "fail: isa; hard_fail: fireflies");
  EXPECT_EQ(golden_image_path(*suite, 12), folder / "golden/a/frame.0012.exr");
}

TEST_F(Golden, ReadsLimitsInsideTheSuiteFile) {
  put("a/suite.json",
      R"({"scene": "s.json", "frames": [3], "tolerance": {"depth": 0.5, "why": "because"}})");
  const auto suite = load_golden_suite(folder, "a");
  ASSERT_TRUE(suite) << suite.error().message;
  EXPECT_EQ(suite->tolerance.depth, 0.5f);
  EXPECT_EQ(suite->tolerance.why, "because");
}

TEST_F(Golden, NamesWhatIsWrongWithASuite) {
  expect_failure("{", "suite.json:1:2: ");
  expect_failure("[]", "must be an object");
  expect_failure(R"({"frames": [1]})", "'scene' is missing");
  expect_failure(R"({"scene": "s"})", "'frames' is missing");
  expect_failure(R"({"scene": "s", "frames": []})", "at least one");
  expect_failure(R"({"scene": "s", "frames": [2, 2]})", "must rise");
  expect_failure(R"({"scene": "s", "frames": [1.5]})", "whole numbers");
  expect_failure(R"({"scene": "s", "frames": [-1]})", "whole numbers");
  expect_failure(R"({"scene": "s", "frame": [1]})", "did you mean 'frames'?");
  expect_failure(R"({"scene": "s", "scene": "t", "frames": [1]})", "duplicate key \"scene\"");
  expect_failure(R"({"scene": "s", "frames": [1], "tolerance": {"fail": 0.1}})", "no reason");
  expect_failure(R"({"scene": "s", "frames": [1], "tolerance": {"fail": 0.1, "why": " "}})",
                 "no reason");
  expect_failure(R"({"scene": )" + std::string(64, '[') + std::string(64, ']') + "}",
                 "nested deeper than 64 levels");
}

TEST_F(Golden, NamesWhatIsWrongWithLimits) {
  expect_limit_failure(R"({"fail": 0.1})", "'fail' must be an object");
  expect_limit_failure(R"({"fail": {"value": 0.1}})", "no reason");
  expect_limit_failure(R"({"fail": {"why": "x"}})", "no 'value'");
  expect_limit_failure(R"({"fail": {"value": -1, "why": "x"}})", "at least 0");
  expect_limit_failure(R"({"fail": {"value": "1", "why": "x"}})", "must be a number");
  expect_limit_failure(R"({"fal": {"value": 1, "why": "x"}})", "did you mean 'fail'?");
}

TEST_F(Golden, LimitsThatNothingCouldExceedAreRefused) {
  const auto expect_refused = [&](const std::string& name, const std::string& value) {
    expect_failure(R"({"scene": "s", "frames": [1], "tolerance": {"why": "x", ")" + name +
                       "\": " + value + "}}",
                   "nothing would fail");
  };
  for (const char* value : {"100", "101", "1e300"}) expect_refused("fail_percent", value);
  for (const char* value : {"1", "1e30", "1e300"}) expect_refused("fail", value);
  for (const char* name : {"relative", "depth", "flip_mean", "flip_p99"}) expect_refused(name, "1");
  expect_refused("normal", "2");
  expect_limit_failure(R"({"fail_percent": {"value": 100, "why": "x"}})", "nothing would fail");
}

TEST_F(Golden, MasksStateTheShareThatTheyMayCover) {
  const std::string mask = R"("masks": [{"file": "m.png", "why": "x"}])";
  const auto suite_with = [&](const std::string& more) {
    return R"({"scene": "s", "frames": [1], )" + more + "}";
  };
  expect_failure(suite_with(mask), "'max_masked_percent' is missing");
  expect_failure(suite_with(mask + R"(, "max_masked_percent": 100)"), "below 100");
  expect_failure(suite_with(mask + R"(, "max_masked_percent": "5")"), "must be a number");
  expect_failure(suite_with(R"("max_masked_percent": 5)"), "for suites with 'masks'");
  put("a/suite.json", suite_with(mask + R"(, "max_masked_percent": 12.5)"));
  EXPECT_EQ(load_golden_suite(folder, "a")->max_masked_percent, 12.5);
}

TEST_F(Golden, LimitsAreGivenOnce) {
  put("a/tolerance.json", "{}");
  expect_failure(R"({"scene": "s", "frames": [1], "tolerance": {"why": "x"}})", "remove one");
}

TEST_F(Golden, ListsSuitesInOrderAndNamesTheNearest) {
  for (const char* name : {"torus-teapot", "puddle", "monkey-torus"})
    put(std::string(name) + "/suite.json", "{}");
  for (const char* note : {"notes.txt", "README", ".gitattributes"}) put(note, "");
  const auto names = list_golden_suites(folder);
  ASSERT_TRUE(names);
  EXPECT_EQ(*names, (std::vector<std::string>{"monkey-torus", "puddle", "torus-teapot"}));
  const auto suite = load_golden_suite(folder, "pudle");
  ASSERT_FALSE(suite);
  EXPECT_NE(suite.error().message.find("did you mean 'puddle'?"), std::string::npos)
      << suite.error().message;
  for (const char* name : {"", ".", "..", "../x", "puddle/../puddle", "notes.txt"})
    EXPECT_FALSE(load_golden_suite(folder, name)) << name;
  EXPECT_FALSE(list_golden_suites(folder / "nowhere"));
}

TEST_F(Golden, NoFolderOrLinkVanishes) {
  const std::string suite = R"({"scene": "s", "frames": [1]})";
  put("good/suite.json", suite);
  put("renamed/suite.jsn", suite);
  put("renamed/frame.0001.exr", "");
  for (const char* name : {"dangling", "looping", "unreadable"})
    fs::create_directories(folder / name);
  fs::create_symlink("/nowhere", folder / "dangling/suite.json");
  fs::create_symlink("suite.json", folder / "looping/suite.json");
  fs::create_symlink("/nowhere", folder / "link");
  fs::create_symlink("loop", folder / "loop");
  fs::create_directory_symlink(folder / "good", folder / "same");
  fs::create_symlink("good/suite.json", folder / "README.md");  // a link is no note
  put("suite.json", suite);                                     // a suite's, one folder too high
  put("unreadable/suite.json", suite);
  fs::permissions(folder / "unreadable", fs::perms::none);
  const auto names = list_golden_suites(folder);
  ASSERT_TRUE(names) << names.error().message;
  EXPECT_EQ(*names,
            (std::vector<std::string>{"README.md", "dangling", "good", "link", "loop", "looping",
                                      "renamed", "same", "suite.json", "unreadable"}));
  for (const std::string& name : *names) {
    const auto loaded = load_golden_suite(folder, name);
    // root may read all
    const bool good =
        name == "good" || name == "same" || (name == "unreadable" && ::geteuid() == 0);
    EXPECT_EQ(loaded.ok(), good) << name;
    if (loaded.ok()) continue;
    EXPECT_EQ(loaded.error().code, ErrorCode::kInput);
    EXPECT_NE(loaded.error().message.find("fix it, or move it away"), std::string::npos)
        << loaded.error().message;
  }
  fs::permissions(folder / "unreadable", fs::perms::owner_all);
}

TEST_F(Golden, AMadeSuiteCanBeRead) {
  GoldenSuite suite;
  suite.folder = folder / "golden/a b";
  suite.scene = folder / "scenes/x \"y\".json";
  suite.frames = {1, 12};
  put("golden/a b/suite.json", suite_json_text(suite));
  const auto back = load_golden_suite(folder / "golden", "a b");
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->scene, suite.scene);
  EXPECT_EQ(back->frames, suite.frames);
}

TEST_F(Golden, SurfaceRecordsSurviveWritingAndReading) {
  const std::vector<SurfaceRecord> records{{1, 1000, 1996, "00ff"}, {12, 5000000000, 3, "abc"}};
  const fs::path csv = folder / "surface.csv";
  ASSERT_TRUE(write_file(csv, surface_records_text(records)));
  const auto back = read_surface_records(csv);
  ASSERT_TRUE(back) << back.error().message;
  ASSERT_EQ(back->size(), 2u);
  EXPECT_EQ((*back)[1].frame, 12);
  EXPECT_EQ((*back)[1].vertices, 5000000000u);
  EXPECT_EQ((*back)[1].triangles, 3u);
  EXPECT_EQ((*back)[1].digest, "abc");
  put("crlf.csv", "frame,vertices,triangles,digest\r\n7,1,2,aa\r\n");
  EXPECT_EQ(read_surface_records(folder / "crlf.csv")->size(), 1u);
}

TEST_F(Golden, NamesTheLineOfABadRecord) {
  const std::string header = "frame,vertices,triangles,digest\n";
  const auto expect = [&](const std::string& text, const std::string& part) {
    put("s.csv", text);
    const auto records = read_surface_records(folder / "s.csv");
    ASSERT_FALSE(records) << text;
    EXPECT_EQ(records.error().code, ErrorCode::kInput);
    EXPECT_NE(records.error().message.find((folder / "s.csv").string() + part), std::string::npos)
        << records.error().message;
  };
  expect("", ":1:");
  expect("frame,vertices\n", ":1:");
  expect(header + "1,2,3\n", ":2:");
  expect(header + "1,2,3,ab\n2,x,3,ab\n", ":3:");
  expect(header + "1,2,3,ab\n1,2,3,ab\n", ":3:");
  expect(header + "1,2,3,ab\n\n2,2,3,ab\n", ":3:");
  expect(header + "1,2,3,XY\n", ":2:");
  EXPECT_FALSE(read_surface_records(folder / "missing.csv"));
}

}  // namespace
}  // namespace polymorph
