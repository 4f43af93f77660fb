#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "base/file.h"
#include "base/hash.h"
#include "base/log.h"
#include "model/shapes.h"
#include "spheres/cache.h"
#include "spheres/spheres.h"
#include "testing/model.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

class Cache : public testing::Test {
 protected:
  /// The nodes' bytes that matter, so that equal means equal in every bit.
  static std::string bits(const SphereTree& tree) {
    std::string text;
    for (const SphereNode& n : tree.nodes)
      text += fmt::format("{:a} {:a} {:a} {:a} {} {} {}\n", n.sphere.center.x, n.sphere.center.y,
                          n.sphere.center.z, n.sphere.radius, n.parent, n.level, n.leaf);
    return text;
  }
  std::string cached() const {
    auto tree = approximate_cached(model_, settings_, cache_);
    EXPECT_TRUE(tree) << (tree ? "" : tree.error().message);
    return tree ? bits(tree->tree) : "";
  }
  std::vector<fs::path> files() const {
    std::vector<fs::path> found;
    if (fs::exists(cache_))
      for (const auto& entry : fs::directory_iterator(cache_)) found.push_back(entry.path());
    return found;
  }
  /// What standard error says while `f` runs.
  template <class F>
  static std::string said(const F& f) {
    testing::internal::CaptureStderr();
    f();
    return testing::internal::GetCapturedStderr();
  }
  static std::size_t lines(const std::string& text) {
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  }

  TemporaryFolder folder_;
  fs::path cache_ = folder_.path() / "deep" / "cache";
  Model model_ = *make_shape("torus");
  SphereSettings settings_{.method = SphereMethod::kActive, .resolution = 4, .fit = FitKind::kNone};
  std::string expected_ = bits(approximate(model_, settings_)->tree);
};

/// A digest that changes when approximate() gives other spheres. If this fails and the change is
/// wanted, raise kSpheresVersion in spheres/cache.h, so that caches do not keep the old spheres,
/// and take the new digests over.
TEST_F(Cache, DigestsArePinned) {
  const auto digest = [](const char* shape, const SphereSettings& settings) {
    const auto made = approximate(*make_shape(shape), settings);
    EXPECT_TRUE(made) << (made ? "" : made.error().message);
    return made ? Hasher().add(bits(made->tree)).hex() : "";
  };
  EXPECT_EQ(
      digest("torus", {.method = SphereMethod::kOctree, .resolution = 4, .fit = FitKind::kNone}),
      "e2d3305d43c47ea461dd9fc49b21a595");
  EXPECT_EQ(
      digest("sphere", {.method = SphereMethod::kActive, .resolution = 5, .fit = FitKind::kNone}),
      "0c65e4d57a9761e05e0c85fd240edc60");
  EXPECT_EQ(digest("cube", {.method = SphereMethod::kMedial, .balls = 20, .fit = FitKind::kNone}),
            "9e5dd455dee6aa59957b4f1380adfe26");
  EXPECT_EQ(kSpheresVersion, 12u) << "also take the new digests over";
}

TEST_F(Cache, AnswersTheSameColdWarmAndWithoutAFolder) {
  EXPECT_EQ(said([&] {
              EXPECT_EQ(cached(), expected_);
              EXPECT_EQ(cached(), expected_);
            }),
            "");
  ASSERT_EQ(files().size(), 1u);
  EXPECT_TRUE(files()[0].filename().string().ends_with(".spheres"));
  cache_.clear();
  EXPECT_EQ(cached(), expected_);
}

TEST_F(Cache, AHitReadsTheFileInsteadOfComputing) {
  cached();
  const auto before = fs::last_write_time(files()[0]);
  // The same model in another entry's place would be noticed; the right entry is not written again.
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(cached(), expected_);
  EXPECT_EQ(fs::last_write_time(files()[0]), before);
}

TEST_F(Cache, TheKeyIsContentAndSettings) {
  const auto count = [&] {
    cached();
    return files().size();
  };
  EXPECT_EQ(count(), 1u);
  model_.name = "another name";
  EXPECT_EQ(count(), 1u) << "names do not matter";
  settings_.resolution = 5;
  EXPECT_EQ(count(), 2u);
  settings_.method = SphereMethod::kOctree;
  EXPECT_EQ(count(), 3u);
  settings_.inside = InsideMethod::kParity;
  EXPECT_EQ(count(), 4u);
  model_.points[5].x += 1e-6f;
  EXPECT_EQ(count(), 5u);
  model_.triangles.pop_back();
  EXPECT_EQ(count(), 6u);
  settings_.balls = 16;
  EXPECT_EQ(count(), 7u);
  settings_.error = 0.1f;
  EXPECT_EQ(count(), 8u);
}

TEST_F(Cache, EveryDamagedOrForeignFileIsOneWarningAndIsReplaced) {
  cached();
  const fs::path file = files()[0];
  const std::string good = *read_file(file);
  std::vector<std::string> broken{
      "",
      good.substr(0, 5),
      good.substr(0, 40),
      good.substr(0, good.size() / 2),
      good.substr(0, good.size() - 1),
      good + "x",
      "something else entirely, and long enough "
      "to be a cache file by its size, if nobody looked at what is in it, really",
      std::string(good.size(), '\0')};
  for (std::size_t at = 0; at < good.size(); at += 37) {  // header, key, count, nodes, checksum
    broken.push_back(good);
    broken.back()[at] = static_cast<char>(broken.back()[at] ^ 0x10);
  }
  for (const std::string& bytes : broken) {
    folder_.write("deep/cache/" + file.filename().string(), bytes);
    const std::string text = said([&] { EXPECT_EQ(cached(), expected_); });
    EXPECT_EQ(lines(text), 1u) << text;
    EXPECT_NE(text.find("cache: "), std::string::npos) << text;
    EXPECT_NE(text.find("computed anew"), std::string::npos) << text;
    EXPECT_EQ(*read_file(file), good) << "replaced";
    EXPECT_EQ(said([&] { cached(); }), "");
  }
}

TEST_F(Cache, AnEntryUnderTheWrongNameIsNotUsed) {
  cached();
  const fs::path torus = files()[0];
  model_ = *make_shape("sphere");
  cached();
  fs::path sphere;
  for (const fs::path& file : files())
    if (file != torus) sphere = file;
  fs::copy_file(torus, sphere, fs::copy_options::overwrite_existing);
  const std::string text = said([&] { EXPECT_NE(cached(), expected_); });
  EXPECT_NE(text.find("belongs to another model"), std::string::npos) << text;
}

TEST_F(Cache, AFolderThatCannotBeIsOneWarningAndNoObstacle) {
  folder_.write("deep/cache", "a file is in the way");
  const std::string text = said([&] {
    EXPECT_EQ(cached(), expected_);
    EXPECT_EQ(cached(), expected_);
  });
  EXPECT_EQ(lines(text), 1u) << text;
  EXPECT_NE(text.find("going on without it"), std::string::npos) << text;
}

TEST_F(Cache, AnEntryThatIsADirectoryIsNoObstacle) {
  cached();
  const fs::path file = files()[0];
  fs::remove(file);
  fs::create_directory(file);
  EXPECT_NE(said([&] { EXPECT_EQ(cached(), expected_); }), "");
}

TEST_F(Cache, ErrorsAreNotCached) {
  settings_.method = SphereMethod::kActive;
  settings_.resolution = 1;
  EXPECT_FALSE(approximate_cached(model_, settings_, cache_));
  EXPECT_TRUE(files().empty());
}

TEST_F(Cache, KeepsFittedBallsInEveryBit) {
  const std::string key(kCacheKeySize, 'a');
  Approximation kept{approximate(model_, settings_)->tree, {}};
  for (int i = 0; i < 5; ++i) {
    Ball ball{{1.0f / 3, static_cast<float>(i), -0.0f}, 0.1f + static_cast<float>(i), -2.5f};
    ball.shape = {2, 0.5f, 1.01f, 0.1f, -0.2f, 0.3f};
    kept.balls.push_back(ball);
  }
  EXPECT_FALSE(load_approximation(cache_, key));
  store_approximation(cache_, key, "box", kept);
  const auto loaded = load_approximation(cache_, key);
  ASSERT_TRUE(loaded);
  EXPECT_EQ(bits(loaded->tree), bits(kept.tree));
  ASSERT_EQ(loaded->balls.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(loaded->balls[i].center, kept.balls[i].center);
    EXPECT_TRUE(std::signbit(loaded->balls[i].center.z));
    EXPECT_EQ(loaded->balls[i].a, kept.balls[i].a);
    EXPECT_EQ(loaded->balls[i].w, kept.balls[i].w);
    EXPECT_EQ(loaded->balls[i].shape, kept.balls[i].shape);
  }
  kept.balls[2].a = -1;
  store_approximation(cache_, key, "box", kept);
  EXPECT_NE(said([&] { EXPECT_FALSE(load_approximation(cache_, key)); }).find("no sound"),
            std::string::npos);
}

TEST_F(Cache, AFileOfAnotherVersionIsNotUsed) {
  cached();
  std::string bytes = *read_file(files()[0]);
  ++bytes[std::string_view("polymorph spheres\n").size()];
  folder_.write("deep/cache/" + files()[0].filename().string(), bytes);
  EXPECT_NE(said([&] { EXPECT_EQ(cached(), expected_); }).find("another version"),
            std::string::npos);
}

TEST_F(Cache, ManyWritersOfOneEntryLeaveItWhole) {
  const std::string key(kCacheKeySize, 'b');
  const Approximation kept{approximate(model_, settings_)->tree, {}};
  std::vector<std::thread> writers;
  std::atomic<int> bad = 0;
  for (int i = 0; i < 4; ++i)
    writers.emplace_back([&] {
      for (int k = 0; k < 5; ++k) {
        store_approximation(cache_, key, "box", kept);
        const auto loaded = load_approximation(cache_, key);
        if (!loaded || bits(loaded->tree) != bits(kept.tree)) ++bad;
      }
    });
  for (std::thread& writer : writers) writer.join();
  EXPECT_EQ(bad, 0);
  EXPECT_EQ(files().size(), 1u) << "no temporary is left";
}

TEST_F(Cache, ListsAndCleansOnlyItsOwnFiles) {
  EXPECT_TRUE(list_cache(cache_).empty()) << "no folder yet";
  const Approximation kept{approximate(model_, settings_)->tree, {}};
  for (const char name : {'a', 'b', 'c'})
    store_approximation(cache_, std::string(kCacheKeySize, name), "box", kept);
  const std::vector<std::string> strangers{"notes.txt", "other.spheres", "empty.spheres"};
  folder_.write("deep/cache/notes.txt", "polymorph spheres\n, but by another name");
  folder_.write("deep/cache/other.spheres", "somebody else's, of the same extension");
  folder_.write("deep/cache/empty.spheres", "");
  fs::create_directory(cache_ / "folder.spheres");
  const fs::path outside = folder_.write("outside.spheres", *read_file(files()[0]));
  fs::create_symlink(cache_ / (std::string(kCacheKeySize, 'a') + ".spheres"),
                     cache_ / "link.spheres");
  const std::vector<CacheEntry> entries = list_cache(cache_);
  ASSERT_EQ(entries.size(), 3u);
  EXPECT_EQ(entries[0].key, std::string(kCacheKeySize, 'a'));
  EXPECT_EQ(entries[0].bytes, fs::file_size(entries[0].file));
  EXPECT_LT(entries[0].age, 100);
  const CacheCleaning cleaning = clear_cache(cache_);
  EXPECT_EQ(cleaning.removed, 3u);
  EXPECT_EQ(cleaning.removed_bytes, 3 * entries[0].bytes);
  EXPECT_TRUE(cleaning.failures.empty());
  EXPECT_TRUE(list_cache(cache_).empty());
  for (const std::string& name : strangers) EXPECT_TRUE(fs::exists(cache_ / name)) << name;
  EXPECT_TRUE(fs::exists(cache_ / "folder.spheres"));
  EXPECT_TRUE(fs::is_symlink(cache_ / "link.spheres"));
  EXPECT_TRUE(fs::exists(outside));
}

TEST_F(Cache, VerifyNamesWhatIsWrong) {
  const Approximation kept{approximate(model_, settings_)->tree, {}};
  for (const char name : {'a', 'b', 'c'})
    store_approximation(cache_, std::string(kCacheKeySize, name), "box", kept);
  const auto file = [&](char name) { return std::string(kCacheKeySize, name) + ".spheres"; };
  std::string bytes = *read_file(cache_ / file('b'));
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  folder_.write("deep/cache/" + file('b'), bytes);
  fs::copy_file(cache_ / file('a'), cache_ / file('c'), fs::copy_options::overwrite_existing);
  const std::vector<CacheEntry> entries = verify_cache(cache_);
  ASSERT_EQ(entries.size(), 3u);
  EXPECT_EQ(entries[0].problem, "");
  EXPECT_EQ(entries[0].spheres, kept.tree.leaves().size());
  EXPECT_EQ(entries[1].problem, "is damaged (wrong checksum)");
  EXPECT_EQ(entries[2].problem, "belongs to another model");
}

TEST_F(Cache, GcRemovesWhatIsOldAndThenTheOldest) {
  const Approximation kept{approximate(model_, settings_)->tree, {}};
  const auto now = fs::file_time_type::clock::now();
  const auto fill = [&] {
    for (int i = 0; i < 5; ++i) {  // a: 5 days old ... e: 1 day
      const std::string key(kCacheKeySize, static_cast<char>('a' + i));
      store_approximation(cache_, key, "box", kept);
      fs::last_write_time(cache_ / (key + ".spheres"), now - std::chrono::hours(24 * (5 - i)));
    }
  };
  fill();
  const std::uint64_t size = list_cache(cache_)[0].bytes;
  CacheCleaning cleaning = trim_cache(cache_, 1000 * size, 3.5 * 86400);
  EXPECT_EQ(cleaning.removed, 2u);
  EXPECT_EQ(cleaning.kept, 3u);
  EXPECT_EQ(list_cache(cache_)[0].key[0], 'c');
  fill();
  cleaning = trim_cache(cache_, 2 * size + 1, 1e9);
  EXPECT_EQ(cleaning.removed, 3u);
  EXPECT_EQ(cleaning.kept_bytes, 2 * size);
  EXPECT_EQ(list_cache(cache_)[0].key[0], 'd') << "the oldest went first";
  EXPECT_EQ(trim_cache(cache_, 0, 1e9).kept, 0u);
}

class CacheFolder : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : kNames) saved_.emplace_back(std::getenv(name) ? std::getenv(name) : "");
    for (const char* name : kNames) ::unsetenv(name);
  }
  void TearDown() override {
    for (std::size_t i = 0; i < saved_.size(); ++i)
      saved_[i].empty() ? ::unsetenv(kNames[i]) : ::setenv(kNames[i], saved_[i].c_str(), 1);
  }
  static constexpr std::array kNames{"POLYMORPH_CACHE_DIR", "XDG_CACHE_HOME", "HOME"};
  std::vector<std::string> saved_;
};

TEST_F(CacheFolder, IsTheFirstThatIsGiven) {
  EXPECT_TRUE(default_cache_folder().empty());
  ::setenv("HOME", "/home/me", 1);
  EXPECT_EQ(default_cache_folder(), "/home/me/.cache/polymorph");
  ::setenv("XDG_CACHE_HOME", "relative", 1);
  EXPECT_EQ(default_cache_folder(), "/home/me/.cache/polymorph")
      << "the specification says: ignore relative ones";
  ::setenv("XDG_CACHE_HOME", "/var/cache/me", 1);
  EXPECT_EQ(default_cache_folder(), "/var/cache/me/polymorph");
  ::setenv("POLYMORPH_CACHE_DIR", "mine", 1);
  EXPECT_EQ(default_cache_folder(), "mine");
}

}  // namespace
}  // namespace polymorph
