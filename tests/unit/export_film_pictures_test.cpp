#include "export/film_pictures.h"

#include <gtest/gtest.h>

namespace polymorph {
namespace {

/// One pixel per frame.
Film film_of(const std::vector<float>& values) {
  Film film;
  for (const float value : values) {
    film.numbers.push_back(static_cast<int>(film.numbers.size()) + 1);
    film.images.push_back(make_image(1, 1, {"R"}));
    film.images.back().pixels[0] = value;
  }
  return film;
}

TEST(SpreadByChange, GivesStillFramesOneCell) {
  const Film film = film_of({0, 0, 0, 0, 1, 2, 3, 3, 3, 3});
  EXPECT_EQ(choose_by_change(film, 4), (std::vector<int>{1, 5, 6, 10}));
  EXPECT_EQ(choose_by_change(film, 8), (std::vector<int>{1, 5, 6, 10}));
}

TEST(SpreadByChange, StepsAreAsLargeAsEachOther) {
  // Slow, then quick: three of four steps are in the quick half.
  const Film film = film_of({0, 0.1f, 0.2f, 0.3f, 0.4f, 1.4f, 2.4f, 3.4f, 4.4f});
  EXPECT_EQ(choose_by_change(film, 5), (std::vector<int>{1, 6, 7, 8, 9}));
}

TEST(SpreadByChange, EndsAtTheLastFrameWhateverIsRounded) {
  for (int n = 2; n < 40; ++n) {
    const Film film = film_of({0.1f, 0.7f, 0.30000001f, 1.1f, 0.9f, 0.9f});
    const std::vector<int> chosen = choose_by_change(film, n);
    EXPECT_EQ(chosen.front(), 1);
    EXPECT_EQ(chosen.back(), 6);
    EXPECT_LE(chosen.size(), 5u);
    EXPECT_TRUE(std::is_sorted(chosen.begin(), chosen.end()));
  }
}

TEST(SpreadByChange, WithoutChangeIsEven) {
  EXPECT_EQ(choose_by_change(film_of({2, 2, 2, 2, 2}), 3), (std::vector<int>{1, 3, 5}));
}

}  // namespace
}  // namespace polymorph
