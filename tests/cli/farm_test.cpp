// What farms rely on: early stops, status, dry runs, signs of life, job scripts.
#include <sys/stat.h>
#include <unistd.h>

#include <regex>

#include "testing/program.h"

namespace polymorph {
namespace {

class Farm : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("scene.json", tiny_scene(6));
  }
  /// Waits until the frame is there, at most a minute.
  void wait_for(const Path& name) const {
    for (int i = 0; i < 600 && !exists(name); ++i) ::usleep(100000);
    ASSERT_TRUE(exists(name));
  }
  /// A command of this name in a folder that the programs' search path begins with.
  void write_command(const std::string& name, const std::string& script) {
    const Path path = write("bin/" + name, script);
    ::chmod(path.c_str(), 0755);
    variables = {{"PATH", (folder / "bin").string() + ":" + std::getenv("PATH")}};
  }
};

TEST_F(Farm, StopsEarlyWithCode75) {
  write("long.json", tiny_scene(500));
  const Started started = start({"render", "long.json", "-o", "f.####.exr", "--spp", "64"});
  wait_for("f.0002.exr");
  ::kill(started.id, SIGUSR1);
  const Ran ran = finish_within(started, 60);
  EXPECT_EQ(ran.code, 75) << ran.err;
  EXPECT_TRUE(contains(ran.err, "stopped; finished frames are whole")) << ran.err;
  EXPECT_LT(count_files(".exr"), 500u);
  EXPECT_EQ(count_files(".part"), 0u);
  const auto status =
      parse(run(1, {"status", "f.####.exr", "long.json", "--spp", "64", "--json"}).out);
  EXPECT_EQ(status["whole"].size(), count_files(".exr"));
  EXPECT_TRUE(status["stale"].empty());
}

TEST_F(Farm, SignsOfLifeWhileAFrameTakesLong) {
  const std::vector<std::string> slow{"render",           "scene.json", "-f",  "1",  "--set",
                                      "image.width=1200", "--spp",      "256", "-t", "1"};
  auto words = slow;
  words.insert(words.end(), {"--heartbeat", "0.2", "-o", "a.exr"});
  const Ran ran = run(0, words);
  EXPECT_TRUE(contains(ran.err, "working: 0/1 frames done, ")) << ran.err;
  words = slow;
  words.insert(words.end(), {"--heartbeat", "0", "-o", "b.exr"});
  EXPECT_FALSE(contains(run(0, words).err, "working: "));
}

TEST_F(Farm, StatusTellsWholeMissingAndStaleFrames) {
  EXPECT_EQ(run(1, {"status", "out", "scene.json"}).out,
            "whole           0  \nmissing         6  1-6\n");
  run(0, {"render", "scene.json", "-o", "out/frame.####.exr", "-f", "1-4"});
  run(0,
      {"render", "scene.json", "-o", "out/frame.####.exr", "-f", "2", "--spp", "2", "--overwrite"});
  write("out/frame.0003.exr", "half a frame");
  const Ran ran = run(1, {"status", "out", "scene.json"});
  EXPECT_EQ(ran.out,
            "whole           2  1,4\nmissing         2  5-6\nstale           1  2\n"
            "unreadable      1  3\n");
  const std::string command =
      "render scene.json -o 'out/frame.####.exr' -f 2-3,5-6 --skip-existing";
  EXPECT_TRUE(contains(ran.err, command)) << ran.err;
  run(0, {"render", "scene.json", "-o", "out/frame.####.exr", "-f", "2-3,5-6", "--skip-existing"});
  EXPECT_EQ(run(0, {"status", "out", "scene.json"}).out, "whole           6  1-6\n");
  // Of other settings nothing is there; and a frame is whole with its PNG alone where that counts.
  EXPECT_EQ(
      parse(run(1, {"status", "out", "scene.json", "--spp", "3", "--json"}).out)["stale"].size(),
      6u);
  EXPECT_EQ(parse(run(1, {"status", "out", "scene.json", "--png", "--json"}).out)["missing"].size(),
            6u);
}

TEST_F(Farm, AKeyThatMovesMakesOnlyItsFramesStale) {
  const auto scene = [&](const char* value) {
    write("keyed.json", tiny_scene(6, R"("cube")",
                                   std::string(R"("lights": {"key_intensity": {"keys":
      [{"frame": 3, "value": 0.5}, {"frame": 5, "value": )") +
                                       value + "}]}},\n"));
  };
  const std::vector<std::string> submit{"submit",         "slurm",   "keyed.json",      "-o",
                                        "f.####.exr",     "--print", "--frame-seconds", "60",
                                        "--task-minutes", "1"};
  scene("0.1");
  run(0, {"render", "keyed.json", "-o", "f.####.exr"});
  EXPECT_EQ(run(0, {"status", "f.####.exr", "keyed.json"}).out, "whole           6  1-6\n");
  EXPECT_TRUE(contains(run(1, submit).err, "every frame is there and current"));
  scene("0.9");
  EXPECT_EQ(run(1, {"status", "f.####.exr", "keyed.json"}).out,
            "whole           3  1-3\nstale           3  4-6\n");
  EXPECT_TRUE(contains(run(0, submit).out, "--array=1-3\n"));
  run(0, {"render", "keyed.json", "-o", "f.####.exr", "--skip-existing"});
  EXPECT_EQ(run(0, {"status", "f.####.exr", "keyed.json"}).out, "whole           6  1-6\n");
  EXPECT_EQ(run(1, submit).out, "");
}

TEST_F(Farm, DryRunSaysFramesTimeAndDisk) {
  run(0, {"render", "scene.json", "-o", "f.####.exr", "-f", "1"});
  const Ran ran = run(0, {"render", "scene.json", "-o", "f.####.exr", "-n", "--skip-existing"});
  EXPECT_TRUE(contains(ran.out, " f.0001.exr (kept)\n")) << ran.out;
  const std::regex said(
      R"(5 frames to render, 1 kept: about .* on \d+ threads? \(.* a frame, .* to prepare\), .* on disk, .* of memory)");
  EXPECT_TRUE(std::regex_search(ran.err, said)) << ran.err;
  EXPECT_EQ(count_files(".exr"), 1u);
  // What it says of the disk is what the frames take.
  const auto report =
      parse(run(0, {"render", "scene.json", "-o", "g.####.exr", "-n", "--json"}).out);
  run(0, {"render", "scene.json", "-o", "g.####.exr"});
  double bytes = 0;
  for (const char* number : {"1", "2", "3", "4", "5", "6"})
    bytes += static_cast<double>(
        std::filesystem::file_size(folder / (std::string("g.000") + number + ".exr")));
  EXPECT_NEAR(report["estimate"]["frame_exr_bytes"].get<double>(), bytes / 6, 0.25 * bytes / 6);
  EXPECT_GT(report["estimate"]["frame_seconds"].get<double>(), 0);
  EXPECT_EQ(report["estimate"]["measured_frames"], 3);
}

TEST_F(Farm, DryRunFitsNothing) {
  const std::filesystem::path cache = folder / "own-cache";
  variables = {{"POLYMORPH_CACHE_DIR", cache.string()}};
  write("fitted.json", R"({"source": {"shape": "cube"}, "target": {"shape": "torus"},
    "spheres": {"balls": 32}, "surface": {"resolution": 16}, "frames": {"count": 4},
    "image": {"width": 32, "height": 24, "samples": 1}})");
  const std::vector<std::string> dry = {"render", "fitted.json", "-o", "d.####.exr", "-n"};
  const Ran first = run(0, dry);
  EXPECT_TRUE(contains(first.err,
                       "this is an estimate: the balls of cube, torus are not in the "
                       "cache"))
      << first.err;
  std::vector<std::string> with_json = dry;
  with_json.push_back("--json");
  const auto again = parse(run(0, with_json).out);
  EXPECT_EQ(again["estimate"]["unfitted"].size(), 2u) << "the dry run before it fitted nothing";
  EXPECT_GT(again["estimate"]["fit_seconds"].get<double>(), 0);
  run(0, {"render", "fitted.json", "-o", "d.####.exr"});
  const Ran cached = run(0, dry);
  EXPECT_FALSE(contains(cached.err, "estimate")) << cached.err;
  EXPECT_TRUE(parse(run(0, with_json).out)["estimate"]["unfitted"].empty());
  // Frames are told by the scene, whatever stands in for its balls.
  std::filesystem::remove_all(cache);
  std::vector<std::string> resumed = dry;
  resumed.push_back("--skip-existing");
  EXPECT_TRUE(contains(run(0, resumed).out, "d.0002.exr (kept)\n"));
}

TEST_F(Farm, MemoryOfTheJobIsALimit) {
  variables = {{"SLURM_MEM_PER_NODE", "1"}};
  const Ran ran = run(5, {"render", "scene.json", "-o", "f.####.exr", "--device", "cpu", "--set",
                          "surface.resolution=256"});
  EXPECT_TRUE(contains(ran.err, "the scene needs ")) << ran.err;
}

TEST_F(Farm, NoNameBecomesCodeOfAJobScript) {
  const std::vector<std::string> submit{"submit",  "slurm",           "scene.json",
                                        "--print", "--frame-seconds", "1"};
  for (const auto& [option, value] : {std::pair<std::string, std::string>{"-o", "a\nb/f.####.exr"},
                                      {"--sbatch", "--account=a\ntouch x"},
                                      {"--sbatch", "--qos=a\rb"},
                                      {"--cache-dir", "c\x7f"}}) {
    std::vector<std::string> words = submit;
    words.insert(words.end(), {option, value});
    EXPECT_TRUE(contains(run(2, words).err, "cannot hold a control character")) << option;
  }
  const Path odd = folder / "a\ntouch x\n#";
  std::filesystem::create_directory(odd);
  std::filesystem::copy(folder / "scene.json", odd / "scene.json");
  folder = odd;
  EXPECT_TRUE(contains(run(2, submit).err, "cannot hold a control character"));
}

TEST_F(Farm, PrintsJobScripts) {
  const Ran ran = run(0, {"submit", "slurm", "scene.json", "-o", "it's/f.####.exr", "--print",
                          "--png", "--spp", "2", "--draft", "--frame-seconds", "70", "--cpus", "3",
                          "--mem", "2G", "--sbatch=--partition=day"});
  for (const char* part :
       {"#SBATCH --job-name=scene\n", "#SBATCH --array=1-3\n", "#SBATCH --cpus-per-task=3\n",
        "#SBATCH --mem=2048M\n", "#SBATCH --time=10\n", "#SBATCH --requeue\n",
        "#SBATCH --signal=B:USR1@210\n", "#SBATCH --partition=day\n",
        "render scene.json -o 'it'\\''s/f.####.exr' --draft --spp 2 --png",
        "--shard \"$SLURM_ARRAY_TASK_ID/3\" --skip-existing", "scontrol requeue",
        "status 'it'\\''s/f.####.exr' scene.json --draft --spp 2 --png\n",
        "#SBATCH --job-name=scene-finish\n"})
    EXPECT_TRUE(contains(ran.out, part)) << part << "\n" << ran.out;
  EXPECT_FALSE(contains(ran.out, "gpus"));
  EXPECT_FALSE(exists("it's"));
  EXPECT_FALSE(exists("slurm"));
  // GPUs are asked for by the tasks that render, not by the job after them.
  const std::string shared =
      run(0, {"submit", "slurm", "scene.json", "--print", "--frame-seconds", "70", "--gpus", "4"})
          .out;
  const std::size_t asked = shared.find("#SBATCH --ntasks=1\n#SBATCH --gpus-per-task=4\n");
  ASSERT_NE(asked, std::string::npos);
  EXPECT_EQ(shared.find("gpus-per-task", asked + 40), std::string::npos);
  EXPECT_TRUE(contains(shared, "--device cuda:all"));
  // Chunks by time: a minute each lets every task have one frame; an hour, one task have all.
  const auto tasks = [&](const char* minutes, const char* seconds) {
    const Ran printed = run(0, {"submit", "slurm", "scene.json", "--print", "--frame-seconds",
                                seconds, "--task-minutes", minutes});
    std::smatch found;
    EXPECT_TRUE(std::regex_search(printed.out, found, std::regex("--array=1-(\\d+)")));
    return found.size() > 1 ? std::stoi(found[1]) : 0;
  };
  EXPECT_EQ(tasks("1", "70"), 6);
  EXPECT_EQ(tasks("60", "70"), 1);
  EXPECT_EQ(tasks("2", "25"), 1);
  EXPECT_EQ(tasks("1", "25"), 2);
  // Told to stop in time for what is under way, but not from the start.
  const auto signal = [&](const char* seconds, const char* minutes) {
    return run(0, {"submit", "slurm", "scene.json", "--print", "--frame-seconds", seconds,
                   "--minutes", minutes})
        .out;
  };
  EXPECT_TRUE(contains(signal("1", "10"), "--signal=B:USR1@90\n"));
  EXPECT_TRUE(contains(signal("70", "1"), "--signal=B:USR1@30\n"));
  EXPECT_TRUE(contains(run(0, {"submit", "slurm", "scene.json", "--print", "--frame-seconds", "70",
                               "--minutes", "30", "--gpus", "1"})
                           .out,
                       "--signal=B:USR1@280\n"));
  // Measured: tiny frames all fit into one task.
  EXPECT_TRUE(contains(run(0, {"submit", "slurm", "scene.json", "--print"}).out, "--array=1-1\n"));
}

TEST_F(Farm, SubmitsAnArrayAndAJobAfterIt) {
  write_command("sbatch",
                "#!/bin/sh\necho \"$@\" >> sbatch.log\necho Hello from the site\necho 77\n");
  const Ran ran =
      run(0, {"submit", "slurm", "scene.json", "-o", "out/f.####.exr", "--frame-seconds", "1"});
  EXPECT_EQ(ran.out, "77\n77\n");
  const auto calls = lines_of(read_text(folder / "sbatch.log"));
  ASSERT_EQ(calls.size(), 2u);
  EXPECT_EQ(calls[0], "--parsable " + (folder / "out/slurm/render.sh").string());
  EXPECT_EQ(calls[1],
            "--parsable --dependency=afterany:77 " + (folder / "out/slurm/finish.sh").string());
  write_command("sbatch", "#!/bin/sh\necho 'no such partition' >&2\nexit 1\n");
  EXPECT_TRUE(contains(run(5, {"submit", "slurm", "scene.json", "--frame-seconds", "1"}).err,
                       "no such partition"));
}

/// The script as Slurm runs it, without Slurm: its signal reaches the program, and the task is
/// queued again.
TEST_F(Farm, TheScriptQueuesAnEarlyStopAgain) {
  write_command("scontrol", "#!/bin/sh\necho \"$@\" > scontrol.log\n");
  write("long.json", tiny_scene(500));
  const Ran printed = run(0, {"submit", "slurm", "long.json", "-o", "f.####.exr", "--print",
                              "--spp", "64", "--tasks", "2", "--frame-seconds", "1"});
  const auto end = printed.out.find("\n\n#!/bin/bash");
  ASSERT_NE(end, std::string::npos);
  write("render.sh", printed.out.substr(0, end + 1));
  const std::string command =
      "cd '" + folder.string() +
      "' && PATH=\"$PWD/bin:$PATH\" SLURM_ARRAY_JOB_ID=5 "
      "SLURM_ARRAY_TASK_ID=2 SLURM_CPUS_PER_TASK=1 bash -c '"
      "bash render.sh 2>log & id=$!; for i in $(seq 600); do [ -f f.0004.exr ] && break; "
      "sleep 0.1; done; kill -USR1 $id; wait $id'";
  const int status = std::system(command.c_str());
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 75) << read_text(folder / "log");
  EXPECT_EQ(read_text(folder / "scontrol.log"), "requeue 5_2\n");
  EXPECT_FALSE(exists("f.0001.exr"));  // of the other task
}

}  // namespace
}  // namespace polymorph
