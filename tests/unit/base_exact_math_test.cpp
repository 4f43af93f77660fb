#include "base/exact_math.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/hash.h"
#include "base/random.h"

namespace polymorph {
namespace {

double between(double low, double high, std::uint64_t key) {
  return low + (high - low) * static_cast<double>(random_u64(1, key, 0) >> 11) * 0x1p-53;
}

/// The functions against the C library's, to a few units of the last place.
TEST(ExactMath, AgreesWithTheLibrary) {
  const auto near = [](double value, double wanted, double scale) {
    EXPECT_NEAR(value, wanted, 6e-16 * std::max(scale, std::fabs(wanted)));
  };
  for (std::uint64_t key = 0; key < 20000; ++key) {
    const double angle = between(-50, 50, 4 * key), small = between(-1, 1, 4 * key + 1);
    const double any = between(-20, 20, 4 * key + 2), positive = std::exp(any);
    near(exact::sin(angle), std::sin(angle), 1);
    near(exact::cos(angle), std::cos(angle), 1);
    near(exact::tan(small), std::tan(small), 1);
    near(exact::exp(any) / std::exp(any), 1, 1);
    near(exact::exp2(any) / std::exp2(any), 1, 1);
    near(exact::log(positive), std::log(positive), 1);
    EXPECT_NEAR(exact::pow(positive, small) / std::pow(positive, small), 1, 1e-14);
    near(exact::atan(any), std::atan(any), 1);
    near(exact::atan2(any, angle), std::atan2(any, angle), 3);
    near(exact::acos(small), std::acos(small), 3);
    near(exact::asin(small), std::asin(small), 1);
    EXPECT_NEAR(exact::log1p(0.9 * small) / std::log1p(0.9 * small), 1, 1e-15);
    EXPECT_NEAR(exact::expm1(any) / std::expm1(any), 1, 2e-15);
    const double tiny = 1e-9 * small;
    EXPECT_NEAR(exact::log1p(tiny) / std::log1p(tiny), 1, 1e-15);
    EXPECT_NEAR(exact::expm1(tiny) / std::expm1(tiny), 1, 1e-15);
  }
}

TEST(ExactMath, Ends) {
  EXPECT_EQ(exact::exp(0), 1);
  EXPECT_EQ(exact::exp(-1000), 0);
  EXPECT_EQ(exact::exp(1000), std::numeric_limits<double>::infinity());
  EXPECT_EQ(exact::exp2(3), 8);
  EXPECT_EQ(exact::exp2(-1), 0.5);
  EXPECT_EQ(exact::log(1), 0);
  EXPECT_EQ(exact::log(0), -std::numeric_limits<double>::infinity());
  EXPECT_EQ(exact::pow(0, 2), 0);
  EXPECT_EQ(exact::pow(2, 0), 1);
  EXPECT_EQ(exact::sin(0), 0);
  EXPECT_EQ(exact::cos(0), 1);
  EXPECT_EQ(exact::acos(1), 0);
  EXPECT_EQ(exact::acos(-1), exact::kPi);
  EXPECT_EQ(exact::atan2(0, 0), 0);
  EXPECT_EQ(exact::atan2(1, 0), exact::kPi / 2);
  EXPECT_EQ(exact::asin(1), exact::kPi / 2);
  EXPECT_EQ(exact::asin(-1), -exact::kPi / 2);
  EXPECT_EQ(exact::log1p(0), 0);
  EXPECT_EQ(exact::log1p(-1), -std::numeric_limits<double>::infinity());
  EXPECT_EQ(exact::expm1(0), 0);
  EXPECT_EQ(exact::expm1(-1000), -1);
  EXPECT_EQ(exact::expm1(1000), std::numeric_limits<double>::infinity());
  EXPECT_TRUE(std::isnan(exact::exp(std::nan(""))));
}

/// Another compiler, processor or library gives these bits, too; what was found on the first one is
/// written down here.
TEST(ExactMath, TheBitsAreThose) {
  Hasher hasher;
  for (std::uint64_t key = 0; key < 4000; ++key) {
    const double x = between(-6, 6, key);
    for (const double value :
         {exact::sin(x), exact::cos(x), exact::tan(x), exact::exp(x), exact::exp2(x),
          exact::log(x * x), exact::pow(x * x, 0.4), exact::atan(x), exact::atan2(x, 1 - x),
          exact::acos(x / 6), exact::asin(x / 6), exact::log1p(x / 6), exact::expm1(x)})
      hasher.add(value);
  }
  EXPECT_EQ(hasher.hex(), "efc5bd1302380deada45de79d1ff05a4");
}

}  // namespace
}  // namespace polymorph
