#include "layfigure/spidar/geometry.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>
#include <sstream>

#include "devices.h"
#include "layfigure/math/rotation.h"

namespace layfigure::spidar {
namespace {

using Eigen::Vector3d;

/// The message that a file with this text is refused with.
std::string refusal(const std::string& text) {
  const std::filesystem::path path = std::filesystem::temp_directory_path() / "layfigure-geometry-test.toml";
  std::ofstream(path) << text;
  try {
    (void)load_geometry(path);
  } catch (const GeometryError& error) {
    return error.what();
  }
  return "";
}

std::string good_text() {
  std::ifstream file(test::device_file("g6x3"));
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(Geometry, EveryFileOfTheProject_IsWrenchClosedNearTheCentre) {
  for (const char* name : test::kDevices) {
    const Geometry geometry = test::device(name);
    EXPECT_TRUE(is_wrench_closed(geometry)) << name;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d turn = 0.3 * Vector3d::Unit(axis);
      EXPECT_TRUE(is_wrench_closed(geometry, {.rotation = math::exp_rotation(turn)})) << name << " axis " << axis;
    }
  }
}

TEST(Geometry, Lengths_AreThoseOfStraightStrings) {
  const Geometry geometry = test::device("g6x3");
  const Lengths lengths = string_lengths(geometry, {});
  EXPECT_NEAR(lengths[0], (geometry.motors[0] - geometry.knots[0]).norm(), 1e-15);
  EXPECT_NEAR(lengths[0], Vector3d(0.0375, 0.076, 0.06).norm(), 1e-12);
}

TEST(Geometry, Jacobian_IsTheDerivativeOfTheLengths) {
  constexpr double kStep = 1e-6;
  const Geometry geometry = test::device("g6x4");
  const Pose pose{.rotation = math::exp_rotation({0.2, -0.4, 0.3}), .position = {0.01, -0.02, 0.015}};
  const auto J = length_jacobian(geometry, pose);
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d step = kStep * Vector3d::Unit(axis);
    Pose there = pose, back = pose;
    there.position += step;
    back.position -= step;
    EXPECT_LT(((string_lengths(geometry, there) - string_lengths(geometry, back)) / (2 * kStep) - J.col(axis)).norm(),
              1e-8);
    there = back = pose;
    there.rotation = math::exp_rotation(step) * pose.rotation;
    back.rotation = math::exp_rotation(-step) * pose.rotation;
    EXPECT_LT(
        ((string_lengths(geometry, there) - string_lengths(geometry, back)) / (2 * kStep) - J.col(3 + axis)).norm(),
        1e-8);
  }
}

TEST(Geometry, CrossTurnedAgainstTheFrame_IsNotClosed) {
  Geometry geometry = test::device("g6x3");
  for (Vector3d& knot : geometry.knots) {
    knot = Eigen::AngleAxisd(-std::numbers::pi / 4.0, Vector3d::UnitY()) * knot;
  }
  EXPECT_FALSE(is_wrench_closed(geometry));
  EXPECT_THROW(validate(geometry), GeometryError);
}

TEST(GeometryFile, Bad_RefusedInOneLineThatNamesTheValue) {
  EXPECT_EQ(refusal(good_text()), "");
  const auto expect_refusal = [](const std::string& text, const std::string& part) {
    const std::string message = refusal(text);
    EXPECT_NE(message.find(part), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos);
  };
  EXPECT_EQ(refusal(good_text() + "\noffsets = [1e-3, 0, 0, 0, 0, 0, 0, -2e-3]\n"), "");
  expect_refusal(good_text() + "\noffsets = [1e-3]\n", "expected eight numbers");
  expect_refusal(good_text() + "\noffsets = [nan, 0, 0, 0, 0, 0, 0, 0]\n", "offsets: must be finite");
  expect_refusal("name = ", "not TOML");
  expect_refusal(good_text() + "\nspeed = 3\n", "unknown key 'speed'");
  expect_refusal(replaced(good_text(), "metres_per_count", "metres_per_pulse"), "unknown key 'metres_per_pulse'");
  expect_refusal(replaced(good_text(), "16.66e-6", "0.0"), "metres_per_count = 0");
  expect_refusal(replaced(good_text(), "16.66e-6", "nan"), "metres_per_count = nan");
  expect_refusal(replaced(good_text(), "16.66e-6", "\"fine\""), "expected a number");
  expect_refusal(replaced(good_text(), "0.3, 20.0", "20.0, 0.3"), "most tension = 0.3");
  expect_refusal(replaced(good_text(), "0.3, 20.0", "0.3"), "expected [least, most]");
  expect_refusal(replaced(good_text(), "  [-0.06, -0.076, 0.06],\n", ""), "motors: expected eight points");
  expect_refusal(replaced(good_text(), "[-0.06, -0.076, 0.06]", "[-0.06, -0.076]"), "motors[0]");
  expect_refusal(replaced(good_text(), "[-0.06, -0.076, 0.06]", "[inf, -0.076, 0.06]"), "string 0");
  expect_refusal(replaced(good_text(), "[-0.06, -0.076, 0.06]", "[-0.0225, 0.0, 0.0]"), "string 0: its motor");
  expect_refusal("name = \"x\"\n", "is missing");
  EXPECT_THROW((void)load_geometry("/no/such/file.toml"), GeometryError);
  EXPECT_THROW((void)load_geometry("/"), GeometryError);
}

}  // namespace
}  // namespace layfigure::spidar
