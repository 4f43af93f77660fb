#include "base/shell_quote.h"

#include <gtest/gtest.h>

#include <cstdio>

namespace polymorph {
namespace {

/// What a shell makes of a word.
std::string echoed(const std::string& word) {
  std::string out;
  FILE* pipe = popen(("printf '%s' " + word).c_str(), "r");
  for (int c; (c = std::fgetc(pipe)) != EOF;) out += static_cast<char>(c);
  pclose(pipe);
  return out;
}

TEST(ShellQuote, PlainWordsStayAsTheyAre) {
  for (const char* word : {"scene.json", "out/frame.0001.exr", "image.samples=64"})
    EXPECT_EQ(quote_for_shell(word), word);
}

TEST(ShellQuote, AShellReadsEveryWordBack) {
  for (const std::string word : {"", "two words", "it's", "$HOME", "a;b", "`id`", "a\"b", "*", "~",
                                 "#", "line\nbreak", "back\\slash", "out/frame.####.exr", "'"})
    EXPECT_EQ(echoed(quote_for_shell(word)), word);
}

}  // namespace
}  // namespace polymorph
