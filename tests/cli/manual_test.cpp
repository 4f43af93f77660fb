// The reference and the completions are made from the program's own options.
#include "testing/program.h"

namespace polymorph {
namespace {

class Manual : public ProgramTest {};

TEST_F(Manual, TheCommittedReferenceIsCurrent) {
  for (const char* what : {"commands", "scene"}) {
    const Path page = source_dir() / "docs" / (std::string(what) + ".md");
    EXPECT_TRUE(run(0, {"manual", what}).out == read_text(page))
        << "run: polymorph manual " << what << " > " << page;
  }
}

TEST_F(Manual, EveryCommandAndOptionIsThere) {
  const auto commands = lines_of(run(0, {"--help"}).out);
  run(0, {"manual", "man", "-o", "man1"});
  const std::string reference = run(0, {"manual", "commands"}).out;
  const std::string bash = run(0, {"completion", "bash"}).out;
  const std::string zsh = run(0, {"completion", "zsh"}).out;
  const std::string fish = run(0, {"completion", "fish"}).out;
  std::size_t found = 0;
  bool list = false;
  for (const std::string& line : commands) {
    if (line == "Commands:") list = true;
    if (line.empty()) list = false;
    if (!list || line == "Commands:" || line.size() < 3 || line[2] == ' ') continue;
    const std::string name = line.substr(2, line.find(' ', 2) - 2);
    ++found;
    EXPECT_TRUE(exists("man1/polymorph-" + name + ".1")) << name;
    EXPECT_TRUE(contains(reference, "\n## " + name + "\n")) << name;
    EXPECT_TRUE(contains(bash, "    " + name + ") options=")) << name;
    EXPECT_TRUE(contains(zsh, "    (" + name + ")\n")) << name;
    EXPECT_TRUE(contains(fish, " -f -a " + name + " -d ")) << name;
  }
  EXPECT_GT(found, 15u);
  // help takes a command's name.
  const std::size_t help = bash.find("    help) options=");
  EXPECT_TRUE(
      contains(bash.substr(help, bash.find('\n', help) - help), "arguments=\"demo init render "));
  EXPECT_TRUE(contains(read_text(folder / "man1/polymorph-render.1"), "\\-\\-skip\\-existing"));
  EXPECT_TRUE(contains(read_text(folder / "man1/polymorph.1"), "POLYMORPH_THREADS"));
  EXPECT_TRUE(contains(run(4, {"manual", "man", "-o", "man1"}).err, "exists"));
}

}  // namespace
}  // namespace polymorph
