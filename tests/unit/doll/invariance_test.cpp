#include <gtest/gtest.h>

#include <cmath>

#include "layfigure/doll/build.h"
#include "rig_fixture.h"
#include "solids.h"

// The same character elsewhere, turned, mirrored or in other units is the same doll.
namespace layfigure::doll {
namespace {

using dynamics::BodyDefinition;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kTolerance = 1e-9;  // relative: some hundred additions of numbers that were moved by metres

/// Sum over the section's axes of value times the axis' dyad: does not change with the axes' signs, nor with which of
/// two axes of equal value is which.
Matrix3d tensor(const Eigen::Quaterniond& axes, const Vector3d& values) {
  return axes * Matrix3d(values.asDiagonal()) * axes.conjugate();
}

void expect_near(const Matrix3d& a, const Matrix3d& b, const std::string& what) {
  EXPECT_LT((a - b).norm(), kTolerance * b.norm()) << what << '\n' << a << "\n\n" << b;
}

/// That `other` is `doll` with all lengths `scale` times as large and each body's axes turned by D.
void expect_same_bodies(const Doll& doll, const Doll& other, const Matrix3d& D, double scale) {
  ASSERT_EQ(other.definition.bodies.size(), doll.definition.bodies.size());
  for (std::size_t b = 0; b < doll.definition.bodies.size(); ++b) {
    const BodyDefinition& body = doll.definition.bodies[b];
    const BodyDefinition& same = other.definition.bodies[b];
    const Section& section = doll.sections[b];
    const Section& twin = other.sections[b];
    EXPECT_EQ(same.name, body.name);
    EXPECT_NEAR(same.mass / std::pow(scale, 3), body.mass, kTolerance * body.mass) << body.name;
    EXPECT_LT((same.com / scale - D * body.com).norm(), kTolerance * std::cbrt(body.mass)) << body.name;
    expect_near(same.inertia / std::pow(scale, 5), D * body.inertia * D.transpose(), body.name);
    EXPECT_EQ(twin.estimated, section.estimated) << body.name;
    EXPECT_NEAR(twin.area / std::pow(scale, 2), section.area, kTolerance * section.area) << body.name;
    EXPECT_NEAR(twin.span / scale, section.span, kTolerance) << body.name;
    expect_near(tensor(twin.axes, twin.second_moments) / std::pow(scale, 4),
                D * tensor(section.axes, section.second_moments) * D.transpose(), body.name);
    expect_near(tensor(twin.axes, twin.outermost) / scale, D * tensor(section.axes, section.outermost) * D.transpose(),
                body.name);
  }
}

void expect_same_laws(const Doll& doll, const Doll& other, const Matrix3d& D) {
  for (std::size_t b = 0; b < doll.definition.bodies.size(); ++b) {
    const BodyDefinition& body = doll.definition.bodies[b];
    if (body.parent < 0) continue;
    const dynamics::JointLaw& law = body.joint;
    const dynamics::JointLaw& same = other.definition.bodies[b].joint;
    const auto expect_same = [&](double value, const Vector3d& ratios, double twin_value, const Vector3d& twin_ratios) {
      expect_near(tensor(same.shape.axes, twin_value * twin_ratios),
                  D * tensor(law.shape.axes, value * ratios) * D.transpose(), body.name);
    };
    expect_same(law.stiffness, law.shape.stiffness, same.stiffness, same.shape.stiffness);
    expect_same(law.damping, law.shape.damping, same.damping, same.shape.damping);
    expect_same(law.yield_torque, law.shape.yield, same.yield_torque, same.shape.yield);
    EXPECT_NEAR(same.flow_damping, law.flow_damping, kTolerance * law.flow_damping) << body.name;
  }
}

class SameDoll : public testing::TestWithParam<bool> {
 protected:
  static character::Rig rig() { return GetParam() ? test::make_flat_adult() : test::make_adult(); }
};

TEST_P(SameDoll, RigMoved_OnlyTheRootMoves) {
  const Doll here = build_doll(rig());
  const Doll there = build_doll(test::moved(rig(), test::odd_motion()));
  expect_same_bodies(here, there, Matrix3d::Identity(), 1.0);
  expect_same_laws(here, there, Matrix3d::Identity());
  for (std::size_t b = 1; b < here.definition.bodies.size(); ++b) {
    const BodyDefinition& a = here.definition.bodies[b];
    const BodyDefinition& c = there.definition.bodies[b];
    EXPECT_LT((a.anchor - c.anchor).norm(), kTolerance) << a.name;
    EXPECT_LT(a.rotation.angularDistance(c.rotation), 1e-7) << a.name;
    EXPECT_LT(here.sections[b].axes.angularDistance(there.sections[b].axes), 1e-7) << a.name;
  }
  EXPECT_LT((there.definition.bodies[0].anchor - test::odd_motion() * here.definition.bodies[0].anchor).norm(),
            kTolerance);
}

TEST_P(SameDoll, RigMirrored_IsTheMirroredDoll) {
  const Doll doll = build_doll(rig());
  const Doll image = build_doll(test::mirrored(rig()));
  const Matrix3d flip = Vector3d(-1, 1, 1).asDiagonal();
  expect_same_bodies(doll, image, flip, 1.0);
  expect_same_laws(doll, image, flip);
}

TEST_P(SameDoll, OtherUnits_AreTheSameShapes) {
  const Doll doll = build_doll(rig(), test::without_minima());
  for (const double scale : {1e3, 1e-3}) {
    const Doll other = build_doll(test::scaled(rig(), scale), test::without_minima());
    expect_same_bodies(doll, other, Matrix3d::Identity(), scale);
  }
}

TEST_P(SameDoll, LeftAndRight_AreAlike) {
  const Doll doll = build_doll(rig());
  for (const char* part : {"0", "1", "2"}) {
    const auto find = [&](const std::string& name) {
      for (std::size_t b = 0; b < doll.definition.bodies.size(); ++b) {
        if (doll.definition.bodies[b].name == name) return b;
      }
      return doll.definition.bodies.size();
    };
    const std::size_t left = find(std::string("left") + part);
    const std::size_t right = find(std::string("right") + part);
    const Section& section = doll.sections.at(left);
    EXPECT_LT((section.second_moments - doll.sections.at(right).second_moments).norm(),
              kTolerance * section.second_moments.norm());
    EXPECT_NEAR(doll.definition.bodies[left].joint.yield_torque, doll.definition.bodies[right].joint.yield_torque,
                kTolerance * doll.definition.bodies[left].joint.yield_torque);
  }
}

INSTANTIATE_TEST_SUITE_P(RoundAndFlat, SameDoll, testing::Bool(),
                         [](const auto& test) { return std::string(test.param ? "Flat" : "Round"); });

/// A round limb's law is laid by its bone; a hair's difference of the mesh does not turn it.
TEST(RoundSection, MeshJittered_KeepsItsAxes) {
  const test::Solid solid = test::cylinder(0.05, 0.6, 48);
  const Section section = build_doll(test::rig_of(solid, 0.0)).sections[1];
  test::Solid jittered = solid;
  for (std::size_t k = 0; k < jittered.points.size(); ++k) {
    const double phase = 12.9898 * static_cast<double>(k);  // no pattern that the mesh has
    jittered.points[k] += 1e-5 * Vector3d(std::sin(phase), std::sin(2.1 * phase), std::sin(3.7 * phase));
  }
  const Section other = build_doll(test::rig_of(jittered, 0.0)).sections[1];
  EXPECT_LT(section.axes.angularDistance(other.axes), 1e-3);
  EXPECT_LT((section.second_moments - other.second_moments).norm(), 1e-2 * section.second_moments.norm());
}

}  // namespace
}  // namespace layfigure::doll
