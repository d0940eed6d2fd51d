#include "layfigure/cache/bytes.h"

#include <gtest/gtest.h>

#include <limits>

namespace layfigure::cache {
namespace {

enum class Colour { kRed, kGreen };

struct Empty {};

struct Inner {
  std::string name{"inner"};
  Eigen::Vector3d place{1, 2, 3};
  bool flag{true};
};

/// Some of all that can be written.
struct Outer {
  int number{7};
  Colour colour{Colour::kGreen};
  double infinite{std::numeric_limits<double>::infinity()};
  Inner inner{};
  std::vector<Inner> inners{{"a", {4, 5, 6}, false}, {}};
  std::vector<Eigen::Vector3i> triangles{{0, 1, 2}, {2, 1, 3}};
  std::vector<bool> flags{true, false, true};
  std::map<std::string, int> lines{{"density", 3}, {"mass", 5}};
  std::pair<int, double> pair{1, 0.5};
  std::array<Inner, 2> both{};
  std::variant<Empty, Inner, double> choice{Inner{"chosen", {0, 0, 1}, true}};
  Eigen::Isometry3d pose{Eigen::Translation3d(1, 2, 3) * Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX())};
  Eigen::Quaterniond rotation{0.5, 0.5, 0.5, 0.5};
};

static_assert(field_count<Empty>() == 0);
static_assert(field_count<Inner>() == 3);
static_assert(field_count<Outer>() == 13);

TEST(Bytes, StructOfEverything_ComesBackEqual) {
  Outer value;
  value.number = -3;
  value.lines["hardening"] = 9;
  value.choice = 2.5;
  value.inners[0].place.y() = -1.0;
  const std::string bytes = to_bytes(value);
  const Outer back = from_bytes<Outer>(bytes);
  EXPECT_EQ(to_bytes(back), bytes);
  EXPECT_EQ(back.number, -3);
  EXPECT_EQ(back.colour, Colour::kGreen);
  EXPECT_EQ(back.infinite, value.infinite);
  EXPECT_EQ(back.inners.at(0).place, Eigen::Vector3d(4, -1, 6));
  EXPECT_EQ(back.triangles, value.triangles);
  EXPECT_EQ(back.flags, value.flags);
  EXPECT_EQ(back.lines, value.lines);
  EXPECT_EQ(back.pair, value.pair);
  EXPECT_EQ(std::get<double>(back.choice), 2.5);
  EXPECT_TRUE(back.pose.isApprox(value.pose, 0.0));
  EXPECT_EQ(back.rotation.coeffs(), value.rotation.coeffs());
}

TEST(Bytes, Optional_IsThereOrNot) {
  using Maybe = std::optional<std::string>;
  EXPECT_EQ(from_bytes<Maybe>(to_bytes(Maybe{})), std::nullopt);
  EXPECT_EQ(from_bytes<Maybe>(to_bytes(Maybe{"there"})), "there");
}

TEST(Bytes, WrittenOverOthers_AreTheSameInTheRoomThatIsThere) {
  std::string bytes = to_bytes(std::vector<double>(100, 1.0));
  const char* const room = bytes.data();
  write_bytes(std::vector<double>(50, 2.0), bytes);
  EXPECT_EQ(bytes, to_bytes(std::vector<double>(50, 2.0)));
  EXPECT_EQ(bytes.data(), room);
}

TEST(Bytes, CutShortOrLonger_AreRefused) {
  const std::string bytes = to_bytes(Outer{});
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_THROW((void)from_bytes<Outer>(std::string_view(bytes).substr(0, length)), std::runtime_error) << length;
  }
  EXPECT_THROW((void)from_bytes<Outer>(bytes + "x"), std::runtime_error);
}

TEST(Bytes, SizeBeyondTheBytes_IsRefusedBeforeMemoryIsTaken) {
  std::string bytes = to_bytes(std::vector<double>{1.0});
  bytes[6] = 1;  // 2^48 more
  EXPECT_THROW((void)from_bytes<std::vector<double>>(bytes), std::runtime_error);
}

TEST(Bytes, AlternativeThatDoesNotExist_IsRefused) {
  using Choice = std::variant<int, double>;
  std::string bytes = to_bytes(Choice{1});
  bytes[0] = 2;
  EXPECT_THROW((void)from_bytes<Choice>(bytes), std::runtime_error);
}

}  // namespace
}  // namespace layfigure::cache
