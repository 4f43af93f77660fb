// Names from files reach terminals and file headers without what those would act upon.
#include "testing/program.h"

namespace polymorph {
namespace {

class UntrustedText : public ProgramTest {
 protected:
  /// No control character but new lines and tabs, no C1, nothing that turns the direction.
  static void expect_clean(const std::string& text, const std::string& where) {
    for (const char c : text)
      EXPECT_TRUE(c == '\n' || c == '\t' || static_cast<unsigned char>(c) >= 0x20) << where << text;
    for (const char* bad : {"\x7f", "\xc2\x9b", "\xe2\x80\xae", "\xe2\x81\xa6"})
      EXPECT_FALSE(contains(text, bad)) << where << text;
  }
  static constexpr const char* kEvil =
      "\x1b[2J\xc2\x9b"
      "31m\xe2\x80\xae\x7f";
};

TEST_F(UntrustedText, NeverReachesTheTerminal) {
  const std::string evil = kEvil;
  write(evil + ".obj",
        "mtllib " + std::string("m\xc2\x9b.mtl") +
            "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\ng \xe2\x80\xaegroup\nf 1 3 2\nf 1 2 4\n"
            "f 1 4 3\nf 2 3 4\n");
  write(
      "scene.json",
      R"({"description": "d", "actors": [{"name": "\u001b[31m\nv 9 9 9\u202e", "source": "cube", "target": "sphere",
            "plan": {"labels": {"\u001b[1m.a": "\u009bb.c"}}}, {"source": "torus", "target": "cube"}],
            "\u001b]0;title\u0007": 1, "surface": {"resolution": 16}})");
  write(evil + ".json", "{\"source\": \"" + std::string("\xe2\x80\xae") + "\", nonsense");
  const std::vector<std::vector<std::string>> commands{
      {"info", evil + ".obj"},
      {"info", evil + ".obj", "--json"},
      {"spheres", evil + ".obj"},
      {"info", "scene.json"},
      {"check", "scene.json"},
      {"check", evil + ".json"},
      {"check", "scene.json", "--json"},
      {"render", evil + ".json"},
      {"compare", evil, evil},
      {"render", "scene.json", "--" + evil},
      {evil},
      {"golden", "test", "--root", evil},
      {"info", "scene.json", "--log-format", "json"}};
  for (const auto& command : commands) {
    const Ran ran = run(command);
    EXPECT_NE(ran.code, 70);
    expect_clean(ran.out, command[0] + " out: ");
    expect_clean(ran.err, command[0] + " err: ");
  }
}

TEST_F(UntrustedText, MakesNoLinesInMessages) {
  const std::string evil = "a\nFORGED\tb";
  const std::string evil_json = "a\\nFORGED\\tb";
  write(evil + ".obj", "v 0 0 0\nf 1 2 3\n");
  write(evil + ".json", "{\"source\": 3}");
  write(evil + ".png", "no picture");
  write("missing.json", "{\"source\": \"" + evil_json + "x.obj\", \"target\": \"cube\"}");
  write("bad.json", "{\"source\": \"" + evil_json + ".obj\", \"target\": \"cube\"}");
  write(evil + "/frame.0001.exr", "no picture");
  write("suites/" + evil + "/suite.json", "{}");
  write(evil + ".zip", "no archive");
  write("cache/" + evil + ".spheres", "polymorph spheres\n");
  write("scene.json", tiny_scene());
  const std::vector<std::vector<std::string>> commands{
      {evil},
      {"info", evil + ".obj"},
      {"info", evil + ".png"},
      {"info", "nowhere/" + evil},
      {"info", "scene.json", "--" + evil},
      {"check", evil + ".json"},
      {"check", "missing.json"},
      {"check", "bad.json"},
      {"check", "bad.json", "--log-format", "json"},
      {"check", "scene.json", "--set", evil + "=3"},
      {"check", "scene.json", "--json", "scene.json/" + evil},
      {"render", "bad.json", "-o", "f.exr", "--progress", "json"},
      {"render", "scene.json", "-o", evil + "/frame.####.exr"},
      {"render", "scene.json", "-o", evil + "/frame.%04d.exr", "--skip-existing", "--dry-run"},
      {"render", "scene.json", "-o", "f.exr", "--log-file", "scene.json/" + evil},
      {"strip", evil + "/frame.####.exr", "-o", "s.png"},
      {"compare", evil + "/frame.####.exr", evil + "/frame.####.exr"},
      {"compare", evil + ".png", evil + ".png"},
      {"golden", "list", "--root", "suites"},
      {"golden", "test", "--root", "suites"},
      {"golden", "test", evil, "--root", "suites"},
      {"golden", "merge", evil + ".zip", "-o", "r"},
      {"spheres", evil + ".obj"},
      {"cache", "ls", "--cache-dir", "cache"},
      {"cache", "verify", "--cache-dir", "cache"},
      {"mesh", "scene.json", "-o", evil},
      {"pairs", evil + ".json"},
      {"submit", evil + ".json"},
      {"status", evil + ".json"},
      {"demo", evil, "cube"},
      {"init", evil + ".obj", evil + ".obj", "-o", "scene.json/" + evil},
      {"analyze", evil + ".json"}};
  bool named = false;
  for (const auto& command : commands) {
    const Ran ran = run(command);
    EXPECT_NE(ran.code, 70);
    for (const std::string& text : {ran.out, ran.err}) {
      EXPECT_FALSE(contains(text, "\nFORGED") || contains(text, "FORGED\t"))
          << command[0] << ": " << text;
      named = named || contains(text, "a?FORGED?b");
    }
  }
  EXPECT_TRUE(named);
}

TEST_F(UntrustedText, MakesNoLinesInHeaders) {
  write("scene.json",
        R"({"actors": [{"name": "a\nv 9 9 9", "source": {"shape": "cube", "spheres": {"balls": 8}},
             "target": {"shape": "sphere", "spheres": {"balls": 6}}},
            {"name": "b\nend_header", "translate": [4, 0, 0],
             "source": {"shape": "cube", "spheres": {"balls": 8}}, "target": {"shape": "sphere", "spheres": {"balls": 6}}}],
            "frames": {"count": 3}, "surface": {"resolution": 16}})");
  run(0, {"mesh", "scene.json", "-f", "2", "-o", "m.obj"});
  run(0, {"mesh", "scene.json", "-f", "2", "-o", "m.ply"});
  const std::string obj = read_text(folder / "m.obj");
  EXPECT_TRUE(contains(obj, "\no a?v 9 9 9\n")) << obj.substr(0, 200);
  EXPECT_FALSE(contains(obj, "\nv 9 9 9"));
  const std::string ply = read_text(folder / "m.ply");
  EXPECT_FALSE(contains(ply.substr(0, ply.find("element vertex")), "\nend_header"));
}

}  // namespace
}  // namespace polymorph
