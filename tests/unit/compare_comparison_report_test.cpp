#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "compare/comparison_report.h"
#include "compare/pictures.h"
#include "image/image_io.h"
#include "testing/temporary_folder.h"

namespace polymorph {
namespace {

Image gradient(int width = 40, int height = 30) {
  Image image = make_image(width, height, {"R", "G", "B"});
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      image.at(x, y, 0) = static_cast<float>(x) / 40;
      image.at(x, y, 1) = static_cast<float>(y) / 30;
      image.at(x, y, 2) = 0.25f;
    }
  return image;
}

ReportCase compared(const std::string& name, const Image& actual, const Image& reference,
                    PictureBudget& budget) {
  ReportCase one;
  one.group = "suite";
  one.name = name;
  PixelMaps maps;
  one.comparison = compare_images(actual, reference, one.tolerance, &maps);
  if (!one.comparison->passed()) one.message = one.comparison->reason;
  EXPECT_TRUE(add_pictures(one, actual, &reference, maps, budget));
  return one;
}

/// One that passes, one that fails, and what could break out of the page or the XML.
Report small_report() {
  PictureBudget budget;
  Image wrong = gradient();
  wrong.at(20, 10, 1) = 0.9f;
  wrong.at(21, 10, 1) = 0.9f;
  Report report{"</script><b>\"title\" & \x01 \xff", {{"isa", "avx2"}}, {}, {"an orphan"}};
  report.cases.push_back(compared("frame 1", gradient(), gradient(), budget));
  report.cases.push_back(compared("frame 2", wrong, gradient(), budget));
  report.cases.back().accept = "update --reason \"<why>\"";
  return report;
}

/// The JSON that the page draws from.
nlohmann::json page_data(const std::string& page) {
  const std::string start = "<script type=\"application/json\" id=\"data\">";
  const auto begin = page.find(start) + start.size();
  auto json = nlohmann::json::parse(page.substr(begin, page.find("</script>", begin) - begin),
                                    nullptr, false);
  EXPECT_FALSE(json.is_discarded());
  return json;
}

std::string from_base64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned value = 0;
  int bits = 0;
  for (const char c : text) {
    if (c == '=') break;
    value = value << 6 | static_cast<unsigned>(digits.find(c));
    if ((bits += 6) >= 8) bytes += static_cast<char>(value >> (bits -= 8) & 255);
  }
  return bytes;
}

TEST(Report, PageShowsFailuresFirstWithTheirPictures) {
  const Report report = small_report();
  EXPECT_EQ(report.failed(), 1u);
  const std::string page = report_html(report);
  EXPECT_EQ(page.find("{{"), std::string::npos);
  const auto data = page_data(page);
  ASSERT_EQ(data["cases"].size(), 2u);
  EXPECT_EQ(data["cases"][0]["name"], "frame 2");
  EXPECT_EQ(data["cases"][0]["accept"], "update --reason \"<why>\"");
  EXPECT_EQ(data["cases"][0]["worst"], nlohmann::json::array({20, 10}));
  EXPECT_EQ(data["notes"][0], "an orphan");
  for (const char* which : {"reference", "actual", "heat", "limits"}) {
    const auto& picture = data["cases"][0]["pictures"][which];
    ASSERT_TRUE(picture.is_string()) << which;
    const auto image = decode_image(from_base64(picture.get<std::string>()), which);
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_EQ(image->width, 40);
    EXPECT_EQ(image->height, 30);
    if (std::string(which) == "actual") {
      EXPECT_NEAR(image->at(20, 10, 1), 0.9f, 0.01f);
    }
    if (std::string(which) == "limits") {
      EXPECT_GT(image->at(20, 10, 0), 0.8f) << "over its limits is red";
      EXPECT_LT(image->at(22, 10, 0), 0.2f);
    }
  }
  EXPECT_FALSE(data["cases"][1]["pictures"].contains("heat")) << "equal pictures have none";
}

TEST(Report, PageNeedsNothingButItself) {
  const std::string page = report_html(small_report());
  for (const char* outside : {"http://", "https://", "src=\"//", "@import", "url(http", "<link"}) {
    std::size_t at = 0;
    while ((at = page.find(outside, at)) != std::string::npos) {
      EXPECT_EQ(page.compare(at, 26, "http://www.w3.org/2000/svg"), 0)
          << page.substr(at, 60) << " (a name of XML is no address)";
      ++at;
    }
  }
  EXPECT_NE(page.find("<title>&lt;/script&gt;&lt;b&gt;&quot;title&quot;"), std::string::npos);
  EXPECT_EQ(page.find("</script><b>"), std::string::npos) << "data cannot end the script";
}

TEST(Report, FiguresStandAgainstTheirLimits) {
  const Report report = small_report();
  const auto figures = case_metrics(report.cases[1]);
  ASSERT_FALSE(figures.empty());
  EXPECT_EQ(figures[0].name, "fail_percent");
  EXPECT_NEAR(figures[0].value, 100.0 * 2 / 1200, 1e-9);
  EXPECT_TRUE(figures[0].over());
  for (const CaseMetric& figure : case_metrics(report.cases[0]))
    EXPECT_FALSE(figure.over()) << figure.name;
  EXPECT_TRUE((CaseMetric{"", "", std::numeric_limits<double>::quiet_NaN(), 1.0}.over()));
  EXPECT_FALSE((CaseMetric{"", "", 5, std::nullopt}.over()));
}

TEST(Report, JunitHasACaseAFrame) {
  const std::string xml = report_junit(small_report());
  EXPECT_NE(xml.find("<testsuite name=\"suite\" tests=\"2\" failures=\"1\""), std::string::npos);
  EXPECT_NE(xml.find("<testcase classname=\"suite\" name=\"frame 1\""), std::string::npos);
  EXPECT_NE(xml.find("<failure message=\"2 of 1200 pixels are over the limits"), std::string::npos);
  EXPECT_NE(xml.find("<property name=\"flip_mean\" value=\""), std::string::npos);
  EXPECT_NE(xml.find("to accept: update --reason &quot;&lt;why&gt;&quot;"), std::string::npos);
  for (const char c : xml) EXPECT_TRUE(c == '\n' || static_cast<unsigned char>(c) >= 0x20);
  EXPECT_EQ(xml.find('\xff'), std::string::npos) << "not UTF-8";
}

TEST(Report, WhatCouldNotBeTestedIsAnErrorNotAFailure) {
  Report report = small_report();
  ReportCase one;
  one.group = "other";
  one.name = "the suite";
  one.message = "scene.json:1:2: no such file\n  {";
  one.error = true;
  report.cases.push_back(one);
  EXPECT_EQ(report.failed(), 2u);
  EXPECT_EQ(report.errors(), 1u);
  const std::string xml = report_junit(report);
  EXPECT_NE(xml.find("tests=\"3\" failures=\"1\" errors=\"1\""), std::string::npos) << xml;
  EXPECT_NE(xml.find("<testsuite name=\"other\" tests=\"1\" failures=\"0\" errors=\"1\""),
            std::string::npos);
  EXPECT_NE(xml.find("<error message=\"scene.json:1:2: no such file"), std::string::npos);
  const auto json = nlohmann::json::parse(dump_json(report_json(report)));
  EXPECT_EQ(json["errors"], 1);
  EXPECT_EQ(json["cases"][2]["verdict"], "error");
  EXPECT_EQ(page_data(report_html(report))["cases"][0]["verdict"], "error") << "the worst first";
}

TEST(Report, JsonSaysAll) {
  const auto json = nlohmann::json::parse(dump_json(report_json(small_report())));
  EXPECT_EQ(json["passed"], 1);
  EXPECT_EQ(json["failed"], 1);
  EXPECT_EQ(json["facts"]["isa"], "avx2");
  EXPECT_EQ(json["cases"][1]["verdict"], "differs");
  EXPECT_EQ(json["cases"][1]["channels"][1]["failing"], 2);
  EXPECT_FALSE(json["cases"][1].contains("pictures"));
  std::uint64_t all = 0;
  for (const auto& count : json["cases"][1]["histogram"]["pixels"]) all += count.get<unsigned>();
  EXPECT_EQ(all, 1200u);
}

TEST(Report, PicturesOfDifferentSizesShareACanvas) {
  PictureBudget budget;
  Report report;
  report.cases.push_back(compared("wide", gradient(50, 30), gradient(40, 35), budget));
  const auto one = page_data(report_html(report))["cases"][0];
  EXPECT_EQ(one["verdict"], "size");
  for (const char* which : {"reference", "actual"}) {
    const auto image = decode_image(from_base64(one["pictures"][which]), which);
    ASSERT_TRUE(image);
    EXPECT_EQ(image->width, 50);
    EXPECT_EQ(image->height, 35);
  }
  EXPECT_FALSE(one["pictures"].contains("heat"));
}

TEST(Report, LongSequencesKeepThumbnailsOnly) {
  PictureBudget budget;
  budget.used = budget.passing;
  const ReportCase passing = compared("a", gradient(), gradient(), budget);
  EXPECT_TRUE(passing.actual_png.empty());
  EXPECT_FALSE(passing.thumbnail_png.empty());
  Image wrong = gradient();
  for (float& value : wrong.pixels) value *= 0.5f;
  EXPECT_FALSE(compared("b", wrong, gradient(), budget).heat_png.empty());
  budget.used = budget.failing;
  EXPECT_TRUE(compared("c", wrong, gradient(), budget).heat_png.empty());
}

TEST(Report, FolderHoldsPageFilesAndAPictureAFailure) {
  const TemporaryFolder temporary;
  const std::filesystem::path folder = temporary.path() / "new/report";
  const auto page = write_report_folder(small_report(), folder, false);
  ASSERT_TRUE(page) << page.error().message;
  EXPECT_EQ(*page, folder / "index.html");
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    files.push_back(entry.path().filename().string());
  std::sort(files.begin(), files.end());
  EXPECT_EQ(files, (std::vector<std::string>{"index.html", "junit.xml", "report.json",
                                             "suite.frame.2.png"}));
  const auto triptych = read_image(folder / "suite.frame.2.png");
  ASSERT_TRUE(triptych);
  EXPECT_EQ(triptych->width, 4 * 6 + 3 * 320) << "three pictures, eight times as large";
}

TEST(Pictures, HeatRisesInLightness) {
  std::vector<float> map(101);
  for (std::size_t i = 0; i < map.size(); ++i) map[i] = 0.01f * static_cast<float>(i);
  const Image heat = heat_picture(map, 101, 1);
  float last = -1;
  for (int x = 0; x < heat.width; ++x) {
    const float light =
        0.2126f * heat.at(x, 0, 0) + 0.7152f * heat.at(x, 0, 1) + 0.0722f * heat.at(x, 0, 2);
    EXPECT_GT(light, last) << x;
    last = light;
  }
  EXPECT_EQ(heat_range(0.6), 1);
  EXPECT_EQ(heat_range(0.05), 0.05);
  EXPECT_EQ(heat_range(0.051), 0.1);
  EXPECT_EQ(heat_range(0), 0.01);
}

TEST(Report, AnEarlierReportGoesAndForeignFilesStay) {
  const TemporaryFolder temporary;
  const std::filesystem::path& folder = temporary.path();
  const auto exists = [&](const char* file) { return std::filesystem::exists(folder / file); };
  ASSERT_TRUE(write_file(folder / "suite.frame.9.png", "somebody's"));
  ASSERT_TRUE(write_file(folder / "notes.txt", "somebody's"));
  ASSERT_TRUE(write_report_folder(small_report(), folder, false));
  EXPECT_TRUE(exists("suite.frame.2.png"));

  Report good = small_report();
  good.cases.pop_back();
  ASSERT_TRUE(write_report_folder(good, folder, false));
  EXPECT_FALSE(exists("suite.frame.2.png")) << "of a failure that is gone";
  EXPECT_TRUE(exists("index.html"));

  ASSERT_TRUE(write_report_folder(small_report(), folder, false));
  ASSERT_TRUE(remove_report(folder));
  for (const char* file : {"index.html", "junit.xml", "report.json", "suite.frame.2.png"})
    EXPECT_FALSE(exists(file)) << file;
  EXPECT_TRUE(exists("suite.frame.9.png") && exists("notes.txt")) << "not ours";

  // Lists of others, and names that lead out of the folder.
  ASSERT_TRUE(write_file(folder / "report.json", R"({"files": ["notes.txt"], "cases": []})"));
  ASSERT_TRUE(remove_report(folder));
  EXPECT_TRUE(exists("notes.txt") && exists("report.json"));
  std::filesystem::create_directory(folder / "inner");
  ASSERT_TRUE(write_file(folder / "inner" / "report.json",
                         R"({"polymorph_report": ["../notes.txt", "..", "", 3, "gone.png"]})"));
  ASSERT_TRUE(remove_report(folder / "inner"));
  EXPECT_TRUE(exists("notes.txt"));
  ASSERT_TRUE(remove_report(folder / "not there"));
}

}  // namespace
}  // namespace polymorph
