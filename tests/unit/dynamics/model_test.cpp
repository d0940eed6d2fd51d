#include "layfigure/dynamics/model.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <ostream>
#include <string>

namespace layfigure::dynamics {
namespace {

ModelDefinition two_bodies() {
  ModelDefinition definition;
  definition.bodies.resize(2);
  definition.bodies[0].name = "hip";
  definition.bodies[1].name = "knee";
  definition.bodies[1].parent = 0;
  return definition;
}

struct BadModel {
  std::string name;
  std::function<void(ModelDefinition&)> spoil;
  std::string message;
};

void PrintTo(const BadModel& model, std::ostream* out) { *out << model.name; }

class ModelRefusal : public ::testing::TestWithParam<BadModel> {};

TEST_P(ModelRefusal, BadDefinition_IsNamed) {
  ModelDefinition definition = two_bodies();
  GetParam().spoil(definition);
  try {
    const Model model(definition);
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find(GetParam().message), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("expected"), std::string::npos) << error.what();
  }
}

const double kNan = std::numeric_limits<double>::quiet_NaN();
const double kInfinity = std::numeric_limits<double>::infinity();

INSTANTIATE_TEST_SUITE_P(
    Each, ModelRefusal,
    ::testing::Values(
        BadModel{"NoBodies", [](auto& d) { d.bodies.clear(); }, "0 bodies"},
        BadModel{"NanGravity", [](auto& d) { d.gravity.x() = kNan; }, "gravity"},
        BadModel{"NanAnchor", [](auto& d) { d.bodies[1].anchor.y() = kNan; }, "'knee': anchor"},
        BadModel{"InfiniteCom", [](auto& d) { d.bodies[1].com.z() = kInfinity; }, "'knee': com"},
        BadModel{"NegativeMass", [](auto& d) { d.bodies[1].mass = -1.0; }, "'knee': mass = -1"},
        BadModel{"ZeroMass", [](auto& d) { d.bodies[0].mass = 0.0; }, "'hip': mass = 0"},
        BadModel{"NanMass", [](auto& d) { d.bodies[0].mass = kNan; }, "'hip': mass"},
        BadModel{"CyclicParents", [](auto& d) { d.bodies[0].parent = 1; }, "'hip': parent = 1"},
        BadModel{"OwnParent", [](auto& d) { d.bodies[1].parent = 1; }, "'knee': parent = 1"},
        BadModel{"ParentBelowMinusOne", [](auto& d) { d.bodies[1].parent = -2; }, "'knee': parent = -2"},
        BadModel{"LongQuaternion", [](auto& d) { d.bodies[1].rotation.w() = 1.1; }, "'knee': rotation"},
        BadModel{"NanQuaternion", [](auto& d) { d.bodies[1].rest_rotation.x() = kNan; }, "'knee': rest rotation"},
        BadModel{"UnsymmetricInertia", [](auto& d) { d.bodies[1].inertia(0, 1) = 0.1; }, "'knee': inertia asymmetry"},
        BadModel{"NegativeInertia", [](auto& d) { d.bodies[1].inertia(2, 2) = -1.0; }, "smallest principal moment"},
        BadModel{"ImpossibleInertia", [](auto& d) { d.bodies[1].inertia(2, 2) = 3.0; }, "largest principal moment"},
        BadModel{"NanInertia", [](auto& d) { d.bodies[1].inertia(0, 0) = kNan; }, "'knee': inertia"},
        BadModel{"NegativeStiffness", [](auto& d) { d.bodies[1].joint.stiffness = -1.0; }, "'knee': stiffness"},
        BadModel{"NanStiffness", [](auto& d) { d.bodies[1].joint.stiffness = kNan; }, "'knee': stiffness"},
        BadModel{"NegativeHardening", [](auto& d) { d.bodies[1].joint.hardening = -1.0; }, "'knee': hardening"},
        BadModel{"InfiniteHardening", [](auto& d) { d.bodies[1].joint.hardening = kInfinity; }, "'knee': hardening"},
        BadModel{"NegativeRatio", [](auto& d) { d.bodies[1].joint.shape.stiffness.y() = -1.0; }, "stiffness ratio"},
        BadModel{"InfiniteRatio", [](auto& d) { d.bodies[1].joint.shape.damping.y() = kInfinity; }, "damping ratio"},
        BadModel{"ZeroYieldRatio", [](auto& d) { d.bodies[1].joint.shape.yield.z() = 0.0; }, "yield ratio = 0"},
        BadModel{"SkewSection", [](auto& d) { d.bodies[1].joint.shape.axes.w() = 0.5; }, "section axes"},
        BadModel{"NegativeDamping", [](auto& d) { d.bodies[1].joint.damping = -1.0; }, "'knee': damping"},
        BadModel{"NegativeFlowDamping", [](auto& d) { d.bodies[1].joint.flow_damping = -1.0; }, "'knee': flow damping"},
        BadModel{"NegativeYield", [](auto& d) { d.bodies[1].joint.yield_torque = -1.0; }, "'knee': yield torque"},
        BadModel{"NanYield", [](auto& d) { d.bodies[1].joint.yield_torque = kNan; }, "'knee': yield torque"}),
    [](const auto& test) { return test.param.name; });

TEST(Model, SlightlyOffQuaternion_IsNormalised) {
  ModelDefinition definition = two_bodies();
  definition.bodies[1].rotation.w() = 1.0 + 1e-7;
  EXPECT_DOUBLE_EQ(Model(definition).body(1).rotation.norm(), 1.0);
}

TEST(Model, Find_ByName) {
  const Model model(two_bodies());
  EXPECT_EQ(model.find("knee"), 1);
  EXPECT_EQ(model.find("elbow"), -1);
}

}  // namespace
}  // namespace layfigure::dynamics
