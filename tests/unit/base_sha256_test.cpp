#include "base/sha256.h"

#include <gtest/gtest.h>

namespace polymorph {
namespace {

std::string of(const std::string& text) { return Sha256().add(text.data(), text.size()).hex(); }

// The examples of FIPS 180-4, and its long one.
TEST(Sha256, GivesTheStandardsExamples) {
  EXPECT_EQ(of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(of(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  Sha256 long_one;
  const std::string part(1000, 'a');
  for (int i = 0; i < 1000; ++i) long_one.add(part.data(), part.size());
  EXPECT_EQ(long_one.hex(), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, MayGoOnAfterItsDigits) {
  Sha256 parts;
  EXPECT_EQ(parts.add("a", 1).hex(), of("a"));
  EXPECT_EQ(parts.add("bc", 2).hex(), of("abc"));
}

}  // namespace
}  // namespace polymorph
