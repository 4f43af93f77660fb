// Reports as users get them: the files, and the page in a real browser (skipped where there is
// none).
#include <map>

#include "image/image_io.h"
#include "testing/program.h"

namespace polymorph {
namespace {

class Reports : public ProgramTest {
 protected:
  /// A grey picture with a square of another grey, `x` from the left.
  void write_picture(const std::string& name, int x, float level = 0.8f) const {
    Image image = make_image(32, 24, {"R", "G", "B"});
    for (float& v : image.pixels) v = 0.3f;
    for (int v = 8; v < 16; ++v)
      for (int u = x; u < x + 8; ++u)
        for (int c = 0; c < 3; ++c) image.at(u, v, c) = level;
    const auto encoded = encode_exr(image);
    ASSERT_TRUE(encoded);
    write(name, *encoded);
  }
  void write_sequences() const {
    for (int frame = 1; frame <= 3; ++frame) {
      write_picture("ref/f.000" + std::to_string(frame) + ".exr", 4);
      write_picture("new/f.000" + std::to_string(frame) + ".exr", frame == 2 ? 12 : 4);
    }
  }
};

TEST_F(Reports, OfSequences) {
  write_sequences();
  const Ran ran = run(1, {"compare", "new/f.####.exr", "ref/f.####.exr", "--report", "out",
                          "--html", "page.html", "--junit", "junit.xml"});
  EXPECT_TRUE(contains(ran.err, "report: page.html")) << ran.err;
  for (const char* name : {"out/index.html", "out/junit.xml", "out/report.json", "out/f.0002.png"})
    EXPECT_TRUE(exists(name)) << name;
  EXPECT_FALSE(exists("out/f.0001.png"));
  EXPECT_EQ(read_text(folder / "out/index.html"), read_text(folder / "page.html"));
  EXPECT_TRUE(contains(read_text(folder / "junit.xml"), "tests=\"3\" failures=\"1\""));
  const auto json = parse(read_text(folder / "out/report.json"));
  EXPECT_EQ(json["cases"][1]["accept"], "cp new/f.0002.exr ref/f.0002.exr");
  EXPECT_EQ(json["cases"][1]["passed"], false);
  EXPECT_EQ(json["cases"][2]["verdict"], "same");
  write("file", "");
  run(4, {"compare", "new/f.####.exr", "ref/f.####.exr", "--report", "file/out"});
}

TEST_F(Reports, LimitsOfFlipAndWarnings) {
  write_picture("a.exr", 4);
  write_picture("b.exr", 4, 0.78f);
  const std::vector<std::string> lax{"compare", "b.exr", "a.exr", "--fail", "1"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), lax.begin(), lax.end());
    return more;
  };
  const auto json = parse(run(0, with({"--json"})).out)["cases"];
  const double mean = json[0]["flip"]["mean"];
  EXPECT_GT(mean, 0);
  run(1, with({"--flip", std::to_string(mean / 2)}));
  run(0, with({"--flip", std::to_string(mean * 2)}));
  run(1, with({"--flip-p99", "0.0001"}));
  const Ran warned = run(0, with({"--warn", "0.01"}));
  EXPECT_TRUE(contains(warned.err, "64 pixels differ by more than 0.01")) << warned.err;
  EXPECT_EQ(run(0, with({"--warn", "0.01", "--warnpercent", "10"})).err, "");
}

TEST_F(Reports, OfGoldenSuites) {
  write("scenes/tiny.json", tiny_scene());
  write("golden_frames/tiny/suite.json",
        R"({"scene": "../../scenes/tiny.json", "frames": [1, 3]})");
  run(1, {"golden", "test", "--report", "missing"});
  const auto missing = parse(read_text(folder / "missing/report.json"));
  EXPECT_EQ(missing["cases"][0]["verdict"], "missing");
  const std::string accept = "polymorph golden accept missing tiny --reason \"...\"";
  EXPECT_EQ(missing["cases"][0]["accept"], accept);
  EXPECT_TRUE(contains(read_text(folder / "missing/index.html"), "golden accept missing tiny"));
  EXPECT_TRUE(
      contains(read_text(folder / "missing/junit.xml"), "to accept: polymorph golden accept"));
  // Frames that are kept elsewhere cannot be taken from the report.
  run(1, {"golden", "test", "--report", "elsewhere", "--failures", "kept"});
  EXPECT_EQ(parse(read_text(folder / "elsewhere/report.json"))["cases"][0]["accept"],
            "polymorph golden update tiny --reason \"...\"");
  EXPECT_TRUE(exists("missing/tiny.frame.3.png"));

  run(0, {"golden", "update", "tiny", "--reason", "first"});
  const auto good = parse(run(0, {"golden", "test", "--json"}).out);
  EXPECT_EQ(good["passed"], 2);

  write("scenes/tiny.json", tiny_scene(4, R"({"shape": "torus", "spheres": {"balls": 12}})"));
  write("golden_frames/tiny/frame.0009.exr", "an orphan");
  run(1, {"golden", "test", "--report", "changed", "--failures", "kept"});
  const auto changed = parse(read_text(folder / "changed/report.json"));
  EXPECT_EQ(changed["failed"], 2);
  EXPECT_TRUE(contains(changed["notes"][0].get<std::string>(), "frame.0009.exr"));
  EXPECT_TRUE(exists("kept/tiny/frame.0003.difference.png"));
  EXPECT_TRUE(contains(read_text(folder / "changed/junit.xml"),
                       "<testcase classname=\"tiny\" name=\"frame 3\""));
}

TEST_F(Reports, NothingOfAnEarlierRunStays) {
  write("scenes/tiny.json", tiny_scene());
  write("golden_frames/tiny/suite.json",
        R"({"scene": "../../scenes/tiny.json", "frames": [1, 3]})");
  const std::vector<std::string> test{"golden", "test",       "--report",
                                      "out",    "--failures", "out/frames"};
  run(1, test);
  write("out/notes.png", "somebody's");
  write("out/frames/tiny/mine.exr", "somebody's");
  EXPECT_TRUE(exists("out/tiny.frame.1.png"));
  EXPECT_TRUE(exists("out/frames/tiny/frame.0001.actual.exr"));
  run(0, {"golden", "update", "tiny", "--reason", "first"});
  run(0, test);
  EXPECT_FALSE(exists("out/tiny.frame.1.png"));
  EXPECT_FALSE(exists("out/frames/tiny/frame.0001.actual.exr"));
  EXPECT_TRUE(exists("out/notes.png") && exists("out/frames/tiny/mine.exr"));
  EXPECT_TRUE(exists("out/index.html"));

  // A run that ends without a report does not leave the one before it.
  run(3, {"compare", "gone.exr", "gone.exr", "--report", "out"});
  EXPECT_FALSE(exists("out/index.html"));
  EXPECT_FALSE(exists("out/junit.xml"));
  EXPECT_TRUE(exists("out/notes.png"));
}

TEST_F(Reports, WhatCannotBeTestedIsReportedAndTheRestIsTested) {
  write("scenes/tiny.json", tiny_scene());
  const std::string suite = R"({"scene": "../../scenes/tiny.json", "frames": [1]})";
  for (const char* name : {"good", "image", "records"}) {
    write(Path("golden_frames") / name / "suite.json", suite);
    run(0, {"golden", "update", name, "--reason", "first"});
  }
  write("golden_frames/image/frame.0001.exr", "damaged");
  write("golden_frames/records/surface.csv", "damaged");
  write("golden_frames/bad/suite.json", R"({"scene": "../../scenes/bad.json", "frames": [1]})");
  write("scenes/bad.json", "{\"sauce\": 1}");
  write("golden_frames/gone/suite.json", R"({"scene": "../../scenes/gone.json", "frames": [1]})");
  const Ran ran = run(3, {"golden", "test", "--report", "out"});
  EXPECT_TRUE(contains(ran.out, "good: 1 of 1 frames pass\n")) << ran.out;
  for (const char* name : {"bad", "gone", "records"})
    EXPECT_TRUE(contains(ran.out, std::string(name) + ": could not be tested\n")) << ran.out;
  EXPECT_TRUE(contains(ran.err, "sauce")) << ran.err;
  const auto json = parse(read_text(folder / "out/report.json"));
  EXPECT_EQ(json["passed"], 1);
  EXPECT_EQ(json["failed"], 4);
  EXPECT_EQ(json["errors"], 4);
  std::map<std::string, std::string> messages;
  for (const auto& one : json["cases"])
    if (one["verdict"] == "error") messages[one["group"]] = one["message"];
  EXPECT_TRUE(contains(messages["bad"], "sauce")) << messages["bad"];
  EXPECT_TRUE(contains(messages["gone"], "gone.json")) << messages["gone"];
  EXPECT_TRUE(contains(messages["image"], "frame.0001.exr")) << messages["image"];
  EXPECT_TRUE(contains(messages["records"], "surface.csv:1")) << messages["records"];
  const std::string junit = read_text(folder / "out/junit.xml");
  EXPECT_TRUE(contains(junit, "tests=\"5\" failures=\"0\" errors=\"4\"")) << junit;
  EXPECT_TRUE(contains(junit, "<testcase classname=\"gone\" name=\"the suite\"")) << junit;
  EXPECT_TRUE(contains(junit, "<error message=\"")) << junit;
  EXPECT_TRUE(contains(read_text(folder / "out/index.html"), "gone.json"));

  // Both kinds of damage are repaired by an update.
  run(0, {"golden", "update", "image", "--reason", "damaged"});
  run(0, {"golden", "update", "records", "--reason", "damaged"});
  run(0, {"golden", "test", "image", "records"});
}

TEST_F(Reports, OfSuitesThatAreNotThere) {
  run(3, {"golden", "test", "--root", "nowhere", "--report", "out"});
  EXPECT_TRUE(contains(read_text(folder / "out/junit.xml"), "errors=\"1\""));
  EXPECT_TRUE(contains(read_text(folder / "out/report.json"), "nowhere: cannot list"));
  run(3, {"golden", "test", "tiny", "--root", "nowhere", "--json", "report.json"});
  EXPECT_EQ(parse(read_text(folder / "report.json"))["errors"], 1);
}

TEST_F(Reports, AsCiMakesThem) {
  write("scenes/tiny.json", tiny_scene());
  write("golden_frames/tiny/suite.json", R"({"scene": "../../scenes/tiny.json", "frames": [1]})");
  const std::string command = "cd '" + folder.string() + "' && CI=true POLYMORPH='" +
                              program_path().string() + "' REPORT=report XDG_CACHE_HOME=. '" +
                              source_dir().string() + "/scripts/ci/golden' > log.txt 2>&1";
  const int missing = std::system(command.c_str());
  EXPECT_EQ(WEXITSTATUS(missing), 1) << read_text(folder / "log.txt");
  EXPECT_TRUE(exists("report/junit.xml"));
  EXPECT_TRUE(exists("report/frames/tiny/frame.0001.actual.exr"));

  run(0, {"golden", "update", "tiny", "--reason", "first"});
  EXPECT_EQ(std::system(command.c_str()), 0) << read_text(folder / "log.txt");
}

/// The first browser of Chromium's kind, or "".
std::string browser() {
  for (const char* name : {"chromium", "chromium-browser", "google-chrome"})
    for (const char* place : {"/usr/bin/", "/usr/local/bin/"})
      if (std::filesystem::exists(std::string(place) + name)) return std::string(place) + name;
  return "";
}

class ReportPage : public Reports {
 protected:
  void SetUp() override {
    Reports::SetUp();
    if (browser().empty()) GTEST_SKIP() << "no chromium here";
    write_sequences();
    run(1, {"compare", "new/f.####.exr", "ref/f.####.exr", "--html", "page.html"});
  }

  /// Starts the browser with `options` on `page` of the folder, without a network. A browser that
  /// does not come up on a busy machine is started again, twice at most; what it made of the page
  /// is never asked for twice.
  void browse(const std::string& options, const std::string& page) {
    const std::string command =
        "cd '" + folder.string() + "' && HOME='" + folder.string() + "' timeout 60 " + browser() +
        " --headless --no-sandbox --disable-gpu --host-resolver-rules='MAP * ~NOTFOUND'"
        " --user-data-dir=profile --window-size=1280,900 " +
        options + " 'file://" + (folder / page).string() + "' > dom.html 2> browser.log";
    int status = -1;
    for (int attempt = 0; attempt < 3 && status != 0; ++attempt) {
      std::filesystem::remove_all(folder / "profile");
      status = std::system(command.c_str());
    }
    EXPECT_EQ(status, 0) << read_text(folder / "browser.log");
  }

  /// Opens the page and runs `script` in it once its pictures are there; `script` calls
  /// say(name, value). Returns what was said. The script runs within the load event, which the
  /// browser waits for before it prints the document, so that nothing depends on time.
  nlohmann::json in_browser(const std::string& script) {
    std::string page = read_text(folder / "page.html");
    page.insert(page.rfind("</body>"), R"(<script>
const said = {errors: 0};
const say = (name, value) => said[name] = value;
const press = key => dispatchEvent(new KeyboardEvent('keydown', {key}));
const see = id => getComputedStyle(document.getElementById(id));
addEventListener('error', () => ++said.errors);
addEventListener('load', () => {
)" + script + R"(
  document.body.replaceChildren(Object.assign(document.createElement('pre'), {id: 'said', textContent: JSON.stringify(said)}));
});
</script>)");
    write("tested.html", page);
    browse("--dump-dom", "tested.html");
    const std::string dom = read_text(folder / "dom.html"), mark = "<pre id=\"said\">";
    const auto at = dom.find(mark);
    if (at == std::string::npos) {
      ADD_FAILURE() << "the script did not come to its end\n" << dom.substr(0, 400);
      return {};
    }
    const auto begin = at + mark.size();
    return parse(dom.substr(begin, dom.find("</pre>", begin) - begin));
  }
};

TEST_F(ReportPage, Loads) {
  const auto said = in_browser(R"(
say('title', document.getElementById('total').textContent);
say('first', document.querySelector('#list [aria-current=true] .name').textContent);
say('listed', document.querySelectorAll('#list button').length);
say('broken', [...document.images].filter(i => !i.naturalWidth).length);
say('outside', performance.getEntriesByType('resource').filter(e => !e.name.startsWith('data:')).map(e => e.name));
say('unnamed', [...document.images].filter(i => !i.hasAttribute('alt')).length);
say('bad', [...document.querySelectorAll('td.bad')].map(t => t.textContent));
say('bars', document.querySelectorAll('svg rect.no').length);
say('accept', document.getElementById('accept').textContent);
)");
  EXPECT_EQ(said["errors"], 0);
  EXPECT_EQ(said["title"], "1 of 3 failed");
  EXPECT_EQ(said["first"], "f.0002.exr") << "failing first";
  EXPECT_EQ(said["listed"], 3);
  EXPECT_EQ(said["broken"], 0);
  EXPECT_EQ(said["unnamed"], 0);
  EXPECT_EQ(said["outside"], nlohmann::json::array());
  EXPECT_GE(said["bad"].size(), 1u);
  EXPECT_GE(said["bars"], 1) << "pixels over their limit in the histogram";
  EXPECT_EQ(said["accept"], "cp new/f.0002.exr ref/f.0002.exr");
}

TEST_F(ReportPage, FlipsByKeyAndByHover) {
  const auto said = in_browser(R"(
press('f'); say('first', see('top').visibility); say('tag', document.querySelector('.tag').textContent);
press('f'); say('second', see('top').visibility);
const f = document.querySelector('.frame');
f.dispatchEvent(new PointerEvent('pointerenter')); say('over', see('top').visibility);
f.dispatchEvent(new PointerEvent('pointerleave')); say('left', see('top').visibility);
say('mode', document.querySelector('[data-mode][aria-pressed=true]').dataset.mode);
)");
  EXPECT_EQ(said["errors"], 0);
  EXPECT_EQ(said["mode"], "flip");
  EXPECT_EQ(said["first"], "visible") << "the reference shows";
  EXPECT_EQ(said["tag"], "reference");
  EXPECT_EQ(said["second"], "hidden");
  EXPECT_EQ(said["over"], "visible");
  EXPECT_EQ(said["left"], "hidden");
}

TEST_F(ReportPage, SwipesByPointerSliderAndKey) {
  const auto said = in_browser(R"(
const bar = () => parseFloat(document.querySelector('.bar').style.left);
const slider = document.getElementById('swipe');
slider.value = 30; slider.dispatchEvent(new Event('input'));
say('slider', bar()); say('clip', see('top').clipPath);
press(']'); say('key', bar());
const f = document.querySelector('.frame'), box = f.getBoundingClientRect();
f.dispatchEvent(new PointerEvent('pointermove', {clientX: box.left + .75 * box.width, clientY: box.top + .5 * box.height, pointerType: 'mouse'}));
say('pointer', bar()); say('readout', document.getElementById('readout').textContent);
)");
  EXPECT_EQ(said["errors"], 0);
  EXPECT_EQ(said["slider"], 30);
  EXPECT_EQ(said["clip"], "inset(0px 70% 0px 0px)");
  EXPECT_EQ(said["key"], 35);
  EXPECT_NEAR(said["pointer"].get<double>(), 75, 0.5);
  // Half-way down, three quarters along: background in both.
  EXPECT_TRUE(contains(said["readout"], "x 24  y 12")) << said["readout"];
  EXPECT_TRUE(contains(said["readout"], "reference 149 149 149")) << said["readout"];
}

TEST_F(ReportPage, KeysReachEveryFrameAndView) {
  const auto said = in_browser(R"(
const name = () => document.querySelector('#view h2').textContent;
const mode = () => document.querySelector('[data-mode][aria-pressed=true]').dataset.mode;
press('4'); say('heat', mode() + ' ' + document.querySelectorAll('.frame img').length);
press('5'); say('limits', mode());
press('3'); say('side', document.querySelectorAll('.frame').length);
press('w'); say('ring', document.querySelectorAll('.ring').length);
const before = document.querySelector('.frame').clientWidth;
press('-'); say('smaller', document.querySelector('.frame').clientWidth < before);
press('j'); say('next', name());
say('holes', (document.body.innerText.match(/null|undefined|NaN\b(?! or)/g) || []).length);
press('k'); press('k'); say('previous', name());
const back = () => getComputedStyle(document.body).backgroundColor;
const light = back(); press('d'); say('themes', light !== back());
)");
  EXPECT_EQ(said["errors"], 0);
  EXPECT_EQ(said["heat"], "heat 1");
  EXPECT_EQ(said["limits"], "limits");
  EXPECT_EQ(said["side"], 2);
  EXPECT_EQ(said["ring"], 2);
  EXPECT_EQ(said["smaller"], true);
  EXPECT_EQ(said["next"], "f.0001.exr");
  EXPECT_EQ(said["holes"], 0) << "what a passing case does not have is left out";
  EXPECT_EQ(said["previous"], "f.0002.exr");
  EXPECT_EQ(said["themes"], true);
}

TEST_F(ReportPage, AScreenshotShowsThePicture) {
  // Without the script that replaces the page at its end.
  browse("--hide-scrollbars --screenshot=shot.png", "page.html");
  const auto shot = read_image(folder / "shot.png");
  ASSERT_TRUE(shot) << shot.error().message;
  ASSERT_EQ(shot->width, 1280);
  // The pictures' grey (0.3 linear); next to nothing else on the page has it.
  std::size_t grey = 0;
  for (int y = 0; y < shot->height; ++y)
    for (int x = 330; x < shot->width; ++x)
      grey +=
          std::abs(shot->at(x, y, 0) - 0.3f) < 0.01f && std::abs(shot->at(x, y, 2) - 0.3f) < 0.01f;
  // 32 x 24 pixels, each 8 x 8 large, less the half of each square that the swipe lets see, the
  // slider and the tags.
  EXPECT_GT(grey, 36000u);
  EXPECT_LE(grey, 64u * (32 * 24 - 12 * 8));
}

TEST_F(Reports, InputsAndForeignFilesStay) {
  write_sequences();
  run(1, {"compare", "new/f.####.exr", "ref/f.####.exr", "--report", "out"});
  write_picture("ref.exr", 4);
  const std::string picture = read_text(folder / "out/f.0002.png");
  // A picture of the report is compared, and a new report would replace it.
  run(4, {"compare", "out/f.0002.png", "ref.exr", "--report", "out"});
  EXPECT_EQ(read_text(folder / "out/f.0002.png"), picture);
  EXPECT_TRUE(exists("out/index.html")) << "all or nothing";
  run(4, {"compare", "out/f.####.png", "new/f.####.exr", "--report", "out"});
  EXPECT_TRUE(exists("out/f.0002.png"));

  // Nor does an earlier report go where a picture of the new one would be in an input's place.
  write("out/own.png", picture);
  const std::string earlier = read_text(folder / "out/report.json");
  run(4, {"compare", "out/own.png", "ref.exr", "--report", "out"});
  EXPECT_EQ(read_text(folder / "out/report.json"), earlier);
  EXPECT_EQ(read_text(folder / "out/own.png"), picture);
  write("there.png", picture);
  run(4, {"compare", "new/f.0001.exr", "ref.exr", "--report", "out", "--diff", "there.png"});
  EXPECT_EQ(read_text(folder / "out/report.json"), earlier);

  write("foreign/report.json",
        R"({"polymorph_report": ["precious.txt", "a.png", "index.html", "report.json"]})");
  for (const char* name : {"precious.txt", "a.png", "index.html"})
    write(Path("foreign") / name, "mine");
  run(4, {"compare", "new/f.0002.exr", "ref/f.0002.exr", "--report", "foreign"});
  write("foreign/report.json",
        R"({"cases": [{"name": 1}, 2], "polymorph_report": ["precious.txt", "a.png"]})");
  run(4, {"compare", "new/f.0002.exr", "ref/f.0002.exr", "--report", "foreign"});
  for (const char* name : {"precious.txt", "a.png", "index.html"})
    EXPECT_TRUE(exists(Path("foreign") / name)) << name;
  // Not even where the names are those of a report.
  write("foreign/report.json",
        R"({"cases": [{"name": "a"}], "polymorph_report": ["a.png", "index.html"]})");
  run(4, {"compare", "new/f.0002.exr", "ref/f.0002.exr", "--report", "foreign"});
  for (const char* name : {"a.png", "index.html"})
    EXPECT_TRUE(exists(Path("foreign") / name)) << name;
  // A preview beside the frames has the name of the failure's picture.
  write("new/f.0002.png", "mine");
  const Ran ran = run(4, {"compare", "new/f.0002.exr", "ref/f.0002.exr", "--report", "new"});
  EXPECT_TRUE(contains(ran.err, "new/f.0002.png: exists - add --overwrite")) << ran.err;
  EXPECT_EQ(read_text(folder / "new/f.0002.png"), "mine");
}

}  // namespace
}  // namespace polymorph
