#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>
#include <string>

#include "fixture.h"

namespace layfigure::collision {
namespace {

using Eigen::Vector3d;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// What the World says when it refuses; empty if it does not.
std::string refusal(const WorldDefinition& definition) {
  try {
    World world(definition);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

std::string refusal(const ShapeDefinition& shape) {
  WorldDefinition definition;
  definition.bodies = 2;
  definition.shapes = {shape};
  return refusal(definition);
}

bool says(const std::string& message, const std::string& part) { return message.find(part) != std::string::npos; }

TEST(WorldDefinition, BadLengths_RefusedByName) {
  for (const double bad : {-0.1, kNan, kInfinity}) {
    EXPECT_TRUE(says(refusal({.name = "head", .shape = Sphere{bad}}), "shape 'head' (0): radius"));
    EXPECT_TRUE(says(refusal({.name = "arm", .shape = Capsule{bad, 1.0}}), "shape 'arm' (0): radius"));
    EXPECT_TRUE(says(refusal({.name = "arm", .shape = Capsule{1.0, bad}}), "half_length"));
    EXPECT_TRUE(says(refusal({.name = "arm", .friction = bad}), "friction"));
    WorldDefinition definition;
    definition.activity = bad;
    EXPECT_TRUE(says(refusal(definition), "activity"));
  }
}

TEST(WorldDefinition, BadHulls_Refused) {
  EXPECT_TRUE(says(refusal({.name = "leg", .shape = ConvexHull{}}), "number of vertices = 0, expected 1 to 256"));
  EXPECT_TRUE(says(refusal({.name = "leg", .shape = ConvexHull{std::vector<Vector3d>(257, Vector3d::Zero())}}), "257"));
  EXPECT_TRUE(says(refusal({.name = "leg", .shape = ConvexHull{{{0, 0, 0}, {0, kNan, 0}}}}), "vertex 1"));
}

TEST(WorldDefinition, BadBodies_Refused) {
  EXPECT_TRUE(says(refusal({.name = "leg", .body = 2}), "body = 2, expected -1 (the world) to 1"));
  EXPECT_TRUE(says(refusal({.name = "leg", .body = -2}), "body = -2"));
  WorldDefinition definition;
  definition.bodies = 2;
  definition.excluded = {{0, 2}};
  EXPECT_TRUE(says(refusal(definition), "excluded pair (0, 2): body = 2"));
  definition.bodies = -1;
  EXPECT_TRUE(says(refusal(definition), "bodies = -1"));
}

TEST(WorldDefinition, BadShapePose_Refused) {
  EXPECT_TRUE(says(refusal({.name = "leg", .X_BS = {.position = {0, 0, kNan}}}), "X_BS"));
  EXPECT_TRUE(says(refusal({.name = "leg", .X_BS = {.rotation = Eigen::Quaterniond(2, 0, 0, 0)}}), "X_BS"));
}

TEST(WorldDefinition, LimitsOfTheRanges_Accepted) {
  EXPECT_EQ(refusal({.name = "point", .shape = Sphere{0.0}, .body = 1, .friction = 0.0}), "");
  EXPECT_EQ(refusal({.name = "point", .shape = Capsule{0.0, 0.0}, .body = kWorldBody}), "");
  EXPECT_EQ(refusal({.name = "hull", .shape = ConvexHull{testing::Random(1).cloud(kMaxHullVertices, 0.1)}}), "");
}

}  // namespace
}  // namespace layfigure::collision
