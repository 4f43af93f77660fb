// Runs the built program in a test, in a folder of its own, and returns its output and exit code.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "testing/paths.h"
#include "testing/temporary_folder.h"

extern char** environ;

namespace polymorph {

/// Result of one run of the program.
struct Ran {
  int code = -1;  ///< exit code; 128 + signal when a signal ended it
  std::string out, err;
};

inline std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

inline std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// Fixture with a temporary folder and an environment without the variables that the program reads.
/// Its cache is shared_cache(); tests of the cache set another one.
class ProgramTest : public ::testing::Test {
 protected:
  using Path = std::filesystem::path;

  void SetUp() override {
    folder = root_.path() / "work";
    std::filesystem::create_directories(folder);
  }

  Path write(const Path& name, const std::string& text) const {
    return root_.write("work" / name, text);
  }
  bool exists(const Path& name) const { return std::filesystem::exists(folder / name); }
  /// Counts the files in and below the folder whose names end with `ending`.
  std::size_t count_files(const std::string& ending) const {
    std::size_t n = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
      n += entry.is_regular_file() && entry.path().filename().string().ends_with(ending);
    return n;
  }

  /// A started program; finish() waits for its end.
  struct Started {
    pid_t id = -1;
    Path out, err;
  };
  Started start(const std::vector<std::string>& arguments) {
    Started started;
    const std::string number = std::to_string(++runs_);
    started.out = out_file.empty() ? root_.path() / (number + ".out") : out_file;
    started.err = root_.path() / (number + ".err");
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    const Path in = in_file.empty() ? Path("/dev/null") : in_file;
    posix_spawn_file_actions_addopen(&actions, 0, in.c_str(), O_RDONLY, 0);
    const int flags = O_WRONLY | O_CREAT | O_TRUNC;
    posix_spawn_file_actions_addopen(&actions, 1, started.out.c_str(), flags, 0600);
    posix_spawn_file_actions_addopen(&actions, 2, started.err.c_str(), flags, 0600);
    posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
    std::vector<std::string> words{program_path().string()};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<std::string> settings = child_environment();
    const int failure = ::posix_spawn(&started.id, words[0].c_str(), &actions, nullptr,
                                      pointers(words).data(), pointers(settings).data());
    posix_spawn_file_actions_destroy(&actions);
    EXPECT_EQ(failure, 0) << words[0];
    return started;
  }
  static Ran finish(const Started& started) {
    int status = 0;
    EXPECT_EQ(::waitpid(started.id, &status, 0), started.id);
    const int code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    const bool readable =
        std::filesystem::is_regular_file(started.out);  // reading /dev/full never ends
    return {code, readable ? read_text(started.out) : "", read_text(started.err)};
  }
  /// Like finish(), but kills the program after `seconds`; the code is then 137.
  static Ran finish_within(const Started& started, int seconds) {
    for (int hundredth = 0; hundredth < 100 * seconds; ++hundredth) {
      siginfo_t ended{};
      if (::waitid(P_PID, static_cast<id_t>(started.id), &ended, WEXITED | WNOHANG | WNOWAIT) ==
              0 &&
          ended.si_pid == started.id)
        return finish(started);
      ::usleep(10000);
    }
    ::kill(started.id, SIGKILL);
    return finish(started);
  }
  Ran run(const std::vector<std::string>& arguments) { return finish(start(arguments)); }
  /// Runs, and fails the test unless the program ends with `code`.
  Ran run(int code, const std::vector<std::string>& arguments) {
    Ran ran = run(arguments);
    std::string command;
    for (const std::string& word : arguments) command += " " + word;
    EXPECT_EQ(ran.code, code) << "polymorph" << command << "\n" << ran.out << ran.err;
    return ran;
  }
  static nlohmann::json parse(const std::string& text) {
    auto json = nlohmann::json::parse(text, nullptr, false);
    EXPECT_FALSE(json.is_discarded()) << text;
    return json;
  }

  Path folder;    ///< working folder of the program
  Path in_file;   ///< standard input; empty: /dev/null
  Path out_file;  ///< standard output; empty: a temporary file
  std::vector<std::pair<std::string, std::string>> variables;  ///< added to the environment

 private:
  std::vector<std::string> child_environment() const {
    std::vector<std::string> all;
    for (char** variable = environ; *variable; ++variable) {
      const std::string text = *variable;
      const std::string name = text.substr(0, text.find('='));
      const bool set_here = std::any_of(variables.begin(), variables.end(),
                                        [&](const auto& one) { return one.first == name; });
      if (name == "CI" || name == "NO_COLOR" || name == "XDG_CACHE_HOME" || set_here ||
          name.starts_with("POLYMORPH_") || name.starts_with("SLURM_"))
        continue;
      all.push_back(text);
    }
    all.push_back("XDG_CACHE_HOME=" + shared_cache().parent_path().string());
    for (const auto& [name, value] : variables) all.push_back(name + "=" + value);
    return all;
  }
  static std::vector<char*> pointers(std::vector<std::string>& words) {
    std::vector<char*> all;
    for (std::string& word : words) all.push_back(word.data());
    all.push_back(nullptr);
    return all;
  }

  TemporaryFolder root_;
  int runs_ = 0;
};

/// Returns a scene that renders in a tenth of a second. `source`: its source, JSON; `more`: further
/// keys, each with a comma after it.
inline std::string tiny_scene(
    int frames = 4, const std::string& source = R"({"shape": "cube", "spheres": {"balls": 12}})",
    const std::string& more = "") {
  return "{\n  \"source\": " + source +
         ",\n"
         "  \"target\": {\"shape\": \"sphere\", \"spheres\": {\"balls\": 6}},\n"
         "  \"frames\": {\"count\": " +
         std::to_string(frames) + "},\n  \"surface\": {\"resolution\": 16},\n" + more +
         "  \"image\": {\"width\": 32, \"height\": 24, \"samples\": 1}\n}\n";
}

}  // namespace polymorph
