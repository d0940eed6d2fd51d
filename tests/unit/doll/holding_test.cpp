#include <gtest/gtest.h>

#include <array>
#include <ostream>
#include <tuple>
#include <vector>

#include "layfigure/doll/build.h"
#include "layfigure/dynamics/step.h"
#include "rig_fixture.h"

// The default doll under the dynamics: it stands, and it keeps what a hand does to it.
namespace layfigure::doll {
namespace {

using Eigen::Vector3d;

dynamics::Coupling pin(const Doll& doll) {
  const auto& root = doll.definition.bodies.front();
  dynamics::Coupling coupling;
  coupling.stiffness = doll.root_pin.stiffness;
  coupling.damping = doll.root_pin.damping;
  coupling.angular_stiffness = doll.root_pin.angular_stiffness;
  coupling.angular_damping = doll.root_pin.angular_damping;
  coupling.target_position = root.anchor;
  coupling.target_rotation = root.rotation;
  return coupling;
}

/// A constant force on one body's com.
class Pull : public dynamics::Loads {
 public:
  Pull(int body, const Vector3d& force) : body_(body), force_(force) {}
  void add(double, std::span<dynamics::BodyForce> forces) const override { forces[body_].force += force_; }

 private:
  int body_;
  Vector3d force_;
};

/// Runs for `duration` [s] and returns the yielding steps, summed over the joints.
int run(const Doll& doll, const dynamics::Model& model, dynamics::State& state, const dynamics::Loads* loads,
        double duration) {
  dynamics::Workspace workspace(model);
  const std::array couplings{pin(doll)};
  const dynamics::StepOptions options{.step = 2e-3, .order = 1};
  int yielding = 0;
  for (double time = 0.0; time < duration; time += options.step) {
    const auto report = dynamics::step(model, state, workspace, {loads, couplings}, options);
    EXPECT_EQ(report.status, dynamics::StepStatus::kOk);
    yielding += report.yielding;
  }
  return yielding;
}

double strain(const dynamics::BodyState& body) { return body.rest_rotation.angularDistance(body.rotation); }

double flow(const Doll& doll, const dynamics::State& state, int body) {
  return doll.definition.bodies[body].rest_rotation.angularDistance(state.bodies[body].rest_rotation);
}

/// From the middle of a cube to its faces and corners.
std::vector<Vector3d> cube_directions() {
  std::vector<Vector3d> directions;
  for (int axis = 0; axis < 3; ++axis) {
    directions.push_back(Vector3d::Unit(axis));
    directions.emplace_back(-Vector3d::Unit(axis));
  }
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d c((corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1, (corner & 4) != 0 ? 1 : -1);
    directions.push_back(c.normalized());
  }
  return directions;
}

struct Hanging {
  const char* name;
  character::Rig rig;
};

void PrintTo(const Hanging& hanging, std::ostream* out) { *out << hanging.name; }

/// n(t): how much of its yield torque a joint bears, in units of t_y.
double load_on(const dynamics::BodyDefinition& body, const dynamics::BodyState& state) {
  const dynamics::JointShape& shape = body.joint.shape;
  return (shape.axes.conjugate() * state.torque).cwiseQuotient(shape.yield).norm() / body.joint.yield_torque;
}

class HoldingIn : public testing::TestWithParam<std::tuple<Hanging, Vector3d>> {};

TEST_P(HoldingIn, DefaultDoll_SagsLittleAndNeverYields) {
  Doll doll = build_doll(std::get<0>(GetParam()).rig);
  doll.definition.gravity = 9.81 * std::get<1>(GetParam());  // as good as turning the doll
  const dynamics::Model model(doll.definition);
  dynamics::State state = dynamics::initial_state(model);
  EXPECT_EQ(run(doll, model, state, nullptr, 3.0), 0);
  for (int b = 1; b < model.size(); ++b) {
    EXPECT_LT(strain(state.bodies[b]), 1.1 * DollSettings{}.largest_sag) << model.body(b).name;
    EXPECT_EQ(flow(doll, state, b), 0.0) << model.body(b).name;
    // A little more than stretched out level: it hangs deeper where it sags.
    EXPECT_LT(load_on(model.body(b), state.bodies[b]), 1.05 / DollSettings{}.hold_margin) << model.body(b).name;
  }
}

INSTANTIATE_TEST_SUITE_P(Orientations, HoldingIn,
                         testing::Combine(testing::Values(Hanging{"RoundAdult", test::make_adult()},
                                                          Hanging{"FlatAdult", test::make_flat_adult()},
                                                          Hanging{"SmallFlatDoll",
                                                                  test::scaled(test::make_flat_adult(), 0.18)}),
                                          testing::ValuesIn(cube_directions())));

TEST(Holding, HandPulledUpAndReleased_TheArmStaysAndTheTrunkComesBack) {
  const Doll doll = build_doll(test::make_adult());
  const dynamics::Model model(doll.definition);
  dynamics::State state = dynamics::initial_state(model);
  const int hand = model.find("left2");
  const int shoulder = model.find("left0");
  const Pull pull(hand, Vector3d(0, 0, 60));
  EXPECT_GT(run(doll, model, state, &pull, 0.6), 0);
  EXPECT_LT(0.1, flow(doll, state, shoulder));
  const double flowed = flow(doll, state, shoulder);
  run(doll, model, state, nullptr, 3.0);
  EXPECT_NEAR(flow(doll, state, shoulder), flowed, 0.05);  // the swing-back may flow a little
  const int trunk = model.find("trunk1");
  EXPECT_EQ(flow(doll, state, trunk), 0.0);
  EXPECT_LT(strain(state.bodies[trunk]), DollSettings{}.largest_sag);
}

}  // namespace
}  // namespace layfigure::doll
