#include "layfigure/app/arguments.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "sample_messages.h"

namespace layfigure::app {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

command_t command_with(const argument_t& argument) {
  command_t command = testing::make_command(1, "test");
  testing::add_argument(command, argument);
  return command;
}

std::string refusal(const std::function<void()>& action) {
  try {
    action();
  } catch (const Refusal& refused) {
    return refused.what();
  }
  return "accepted";
}

TEST(Arguments, Absent_GivesNothing) {
  const command_t command = testing::make_command(1, "test");
  const Arguments arguments(command, {"a"});
  EXPECT_FALSE(arguments.text("a"));
  EXPECT_FALSE(arguments.number("a", 0, 1));
  EXPECT_FALSE(arguments.vector("a", 1));
  EXPECT_TRUE(arguments.integers("a").empty());
}

TEST(Arguments, UnknownOrTwice_Refused) {
  command_t command = command_with(testing::number_argument("a", {1.0}));
  EXPECT_EQ(refusal([&] { Arguments(command, {"b"}); }), "test has no argument 'a'");
  testing::add_argument(command, testing::number_argument("a", {1.0}));
  EXPECT_EQ(refusal([&] { Arguments(command, {"a"}); }), "argument 'a' comes twice");
}

TEST(Arguments, Number_InRangeOnly) {
  for (const double value : {-1.0, 2.5, kNan, std::numeric_limits<double>::infinity()}) {
    const command_t command = command_with(testing::number_argument("a", {value}));
    EXPECT_NE(refusal([&] { static_cast<void>(Arguments(command, {"a"}).number("a", 0, 2)); }), "accepted") << value;
  }
  const command_t command = command_with(testing::number_argument("a", {1.5}));
  EXPECT_EQ(Arguments(command, {"a"}).number("a", 0, 2), 1.5);
}

TEST(Arguments, NumberOfWrongCountOrKind_Refused) {
  for (const argument_t& argument :
       {testing::number_argument("a", {}), testing::number_argument("a", {1, 2}), testing::text_argument("a", "1")}) {
    const command_t command = command_with(argument);
    EXPECT_NE(refusal([&] { static_cast<void>(Arguments(command, {"a"}).number("a", 0, 2)); }), "accepted");
  }
}

TEST(Arguments, Integer_WholeOnly) {
  const command_t whole = command_with(testing::number_argument("a", {7}));
  EXPECT_EQ(Arguments(whole, {"a"}).integer("a", 1, 10), 7);
  const command_t broken = command_with(testing::number_argument("a", {7.5}));
  EXPECT_EQ(refusal([&] { static_cast<void>(Arguments(broken, {"a"}).integer("a", 1, 10)); }),
            "argument 'a' is 7.5, expected a whole number");
}

TEST(Arguments, Vector_ThreeFiniteNumbersOnly) {
  const command_t good = command_with(testing::number_argument("a", {1, -2, 3}));
  EXPECT_EQ(Arguments(good, {"a"}).vector("a", 5), Eigen::Vector3d(1, -2, 3));
  for (const std::vector<double>& values :
       std::vector<std::vector<double>>{{1, 2}, {1, 2, 3, 4}, {1, kNan, 3}, {1, 2, -6}}) {
    const command_t command = command_with(testing::number_argument("a", values));
    EXPECT_NE(refusal([&] { static_cast<void>(Arguments(command, {"a"}).vector("a", 5)); }), "accepted");
  }
}

TEST(Arguments, Integers_NoneNegativeOrBroken) {
  const command_t good = command_with(testing::number_argument("a", {0, 5}));
  EXPECT_EQ(Arguments(good, {"a"}).integers("a").size(), 2U);
  for (const double value : {-1.0, 0.5, kNan, 1e300}) {
    const command_t command = command_with(testing::number_argument("a", {0, value}));
    EXPECT_NE(refusal([&] { static_cast<void>(Arguments(command, {"a"}).integers("a")); }), "accepted") << value;
  }
}

TEST(Arguments, Text_NeitherEmptyNorNumbers) {
  const command_t good = command_with(testing::text_argument("a", "bone"));
  EXPECT_EQ(Arguments(good, {"a"}).text("a"), "bone");
  for (const argument_t& argument : {testing::text_argument("a", ""), testing::number_argument("a", {1})}) {
    const command_t command = command_with(argument);
    EXPECT_EQ(refusal([&] { static_cast<void>(Arguments(command, {"a"}).text("a")); }), "argument 'a' is not a text");
  }
}

}  // namespace
}  // namespace layfigure::app
