#include "base/packed_text.h"

#include <gtest/gtest.h>

namespace polymorph {
namespace {

TEST(PackedText, ComesBack) {
  for (const std::string& text :
       {std::string(), std::string("a"), std::string(100'000, 'x'), std::string("\0\xff\n", 3)}) {
    const std::string packed = pack_text(text);
    EXPECT_EQ(packed.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456"
                                       "789+/="),
              std::string::npos);
    const auto back = unpack_text(packed, text.size());
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(*back, text);
  }
}

TEST(PackedText, StopsAtItsLimit) {
  const std::string bomb = pack_text(std::string(8u << 20, ' '));
  EXPECT_LT(bomb.size(), 100'000u);
  const auto unpacked = unpack_text(bomb, 1000);
  ASSERT_FALSE(unpacked);
  EXPECT_EQ(unpacked.error().code, ErrorCode::kInput);
  EXPECT_EQ(unpacked.error().message, "it unpacks to more than 1000 bytes");
}

TEST(PackedText, RefusesWhatIsDamaged) {
  const std::string packed = pack_text("a text that is long enough to be cut and changed");
  EXPECT_FALSE(unpack_text("", 1000));
  EXPECT_FALSE(unpack_text("not base64!", 1000));
  EXPECT_FALSE(unpack_text("aaaa", 1000));
  for (std::size_t length = 0; length < packed.size(); ++length)
    EXPECT_FALSE(unpack_text(packed.substr(0, length), 1000)) << length;
  EXPECT_FALSE(unpack_text(packed + "AAAA", 1000));
  std::string changed = packed;
  changed[packed.size() / 2] = changed[packed.size() / 2] == 'A' ? 'B' : 'A';
  EXPECT_FALSE(unpack_text(changed, 1000));
}

}  // namespace
}  // namespace polymorph
