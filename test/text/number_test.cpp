// Numbers from outside.

#include "youbot_base_sim/text/number.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace youbot_base_sim {
namespace {

TEST(NumberTest, AllOfTheTextIsANumber) {
  double number = 0;
  EXPECT_TRUE(read_number("-1.5e3", number));
  EXPECT_EQ(number, -1500);
  for (const std::string_view text : {"", "1x", "1 ", " 1", "\t1", "x", "1,2", "0x1p3", "0X10", "-0x1"})
    EXPECT_FALSE(read_number(text, number)) << text;
  EXPECT_FALSE(read_number(std::string_view("1\0x", 3), number));
}

TEST(NumberTest, RangesIncludeTheirEnds) {
  constexpr Range range{2, 3, "m", true};
  for (const double number : {0.0, 2.0, 3.0}) EXPECT_TRUE(contains(range, number)) << number;
  for (const double number : {1.9, 3.1, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_FALSE(contains(range, number)) << number;
  }
}

TEST(NumberTest, RangesAreToldInWords) {
  EXPECT_EQ(text_of({1e-6, 1e6, "kg"}), "a finite number > 0, from 1e-06 to 1e+06 kg");
  EXPECT_EQ(text_of({0, 100, ""}), "a finite number >= 0, up to 100");
  EXPECT_EQ(text_of({1e-6, 10, "s", true}), "a finite number >= 0: 0 or from 1e-06 to 10 s");
  EXPECT_EQ(text_of({-3, 3, "m"}), "a finite number from -3 to 3 m");
}

}  // namespace
}  // namespace youbot_base_sim
