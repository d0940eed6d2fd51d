#include "random_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <random>
#include <sstream>

#include "layfigure/math/rotation.h"

namespace layfigure::testing {
namespace {

using namespace dynamics;

constexpr double kUnitTolerance = 1e-12;

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed) {}
  bool one_in(int n) { return random_() % static_cast<std::uint64_t>(n) == 0; }
  int below(int n) { return static_cast<int>(random_() % static_cast<std::uint64_t>(n)); }
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1.0p-53;
  }
  double log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  Eigen::Vector3d vector(double size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }

 private:
  std::mt19937_64 random_;
};

Eigen::Matrix3d random_inertia(Dice& dice, double mass) {
  if (dice.one_in(10)) return Eigen::Matrix3d::Zero();  // a point
  const double size = dice.log_uniform(1e-3, 1.0);
  // A box; one in ten has no thickness at all.
  const Eigen::Vector3d side(size, size * dice.log_uniform(1e-3, 1.0), dice.one_in(10) ? 0.0 : size);
  const Eigen::Vector3d squares = mass / 12.0 * side.cwiseAbs2();
  const Eigen::Matrix3d R = math::exp_rotation(dice.vector(2.0)).toRotationMatrix();
  const Eigen::Vector3d moments(squares.y() + squares.z(), squares.x() + squares.z(), squares.x() + squares.y());
  const Eigen::Matrix3d inertia = R * moments.asDiagonal() * R.transpose();
  return 0.5 * (inertia + inertia.transpose());
}

JointLaw random_law(Dice& dice) {
  JointLaw law;
  law.stiffness = dice.one_in(6) ? 0.0 : dice.log_uniform(1e-4, 1e9);
  law.damping = dice.one_in(4) ? 0.0 : dice.log_uniform(1e-6, 1e3);
  if (dice.one_in(2)) law.yield_torque = dice.one_in(5) ? 0.0 : dice.log_uniform(1e-4, 1e3);
  law.flow_damping = dice.one_in(4) ? 0.0 : dice.log_uniform(1e-4, 1e3);
  law.hardening = dice.one_in(3) ? dice.log_uniform(1e-3, 1e2) : 0.0;
  if (dice.one_in(3)) {
    law.shape.axes = math::exp_rotation(dice.vector(2.0));
    law.shape.stiffness = {dice.log_uniform(0.1, 10.0), 1.0, dice.log_uniform(0.1, 10.0)};
    law.shape.yield = {1.0, dice.log_uniform(0.1, 10.0), dice.one_in(4) ? INFINITY : 1.0};
    law.shape.locked = {dice.one_in(4), dice.one_in(4), dice.one_in(4)};
  }
  return law;
}

BodyDefinition random_body(Dice& dice, int index) {
  BodyDefinition body;
  body.name = "body" + std::to_string(index);
  body.parent = index == 0 ? -1 : dice.one_in(3) ? dice.below(index) : index - 1;
  body.anchor = dice.one_in(8) ? Eigen::Vector3d::Zero() : dice.vector(0.3);
  body.rotation = math::exp_rotation(dice.vector(1.5));
  if (dice.one_in(2)) body.rest_rotation = body.rotation;
  body.mass = dice.log_uniform(1e-3, 1e3);
  body.com = dice.one_in(8) ? Eigen::Vector3d::Zero() : dice.vector(0.2);
  body.inertia = random_inertia(dice, body.mass);
  body.joint = random_law(dice);
  return body;
}

Coupling random_coupling(Dice& dice, int bodies) {
  Coupling coupling;
  coupling.body = dice.below(bodies);
  coupling.point = dice.vector(0.2);
  coupling.stiffness = dice.log_uniform(1.0, 1e7);
  coupling.damping = dice.one_in(3) ? 0.0 : dice.log_uniform(0.1, 1e4);
  if (dice.one_in(2)) {
    coupling.angular_stiffness = dice.log_uniform(1e-2, 1e5);
    coupling.angular_damping = dice.log_uniform(1e-3, 1e2);
  }
  coupling.target_position = dice.vector(2.0);
  return coupling;
}

class ConstantForces : public Loads {
 public:
  explicit ConstantForces(const std::vector<BodyForce>& forces) : forces_(forces) {}
  void add(double, std::span<BodyForce> forces) const override {
    for (std::size_t i = 0; i < forces.size(); ++i) {
      forces[i].force += forces_[i].force;
      forces[i].torque += forces_[i].torque;
    }
  }

 private:
  const std::vector<BodyForce>& forces_;
};

State start_of(const Model& model, const StressScene& scene) {
  State state = initial_state(model);
  std::vector<BodyPose> poses;
  world_poses(model, state, poses);
  for (int i = 0; i < model.size(); ++i) {
    const Eigen::Matrix3d R = poses[i].rotation.toRotationMatrix();
    state.bodies[i].angular_momentum = R * model.body(i).inertia * R.transpose() * scene.spins[i];
  }
  return state;
}

std::string broken_rotation(const State& state) {
  for (std::size_t i = 0; i < state.bodies.size(); ++i) {
    const BodyState& body = state.bodies[i];
    if (std::abs(body.rotation.norm() - 1.0) > kUnitTolerance) return "rotation of body " + std::to_string(i);
    if (std::abs(body.rest_rotation.norm() - 1.0) > kUnitTolerance) return "rest of body " + std::to_string(i);
  }
  return "";
}

}  // namespace

StressScene random_scene(std::uint64_t seed) {
  Dice dice(seed);
  StressScene scene{.seed = seed, .definition = {}, .spins = {}, .forces = {}, .couplings = {}};
  const int bodies = 1 + dice.below(24);
  for (int i = 0; i < bodies; ++i) scene.definition.bodies.push_back(random_body(dice, i));
  scene.definition.law = dice.one_in(2) ? FlowLaw::kPaper : FlowLaw::kOverstress;
  scene.definition.root = std::array{RootKind::kBall, RootKind::kFree, RootKind::kFixed}[dice.below(3)];
  if (dice.one_in(4)) scene.definition.gravity.setZero();
  scene.h = dice.log_uniform(1e-5, 0.1);
  scene.order = dice.one_in(4) ? 1 + dice.below(4) : 1;
  scene.spins.assign(bodies, Eigen::Vector3d::Zero());
  scene.forces.resize(bodies);
  if (dice.one_in(3)) scene.spins[dice.below(bodies)] = dice.vector(dice.log_uniform(1.0, 1e3));
  if (dice.one_in(3)) scene.forces[dice.below(bodies)].force = dice.vector(dice.log_uniform(1.0, 1e6));
  for (int k = dice.below(3); k > 0; --k) scene.couplings.push_back(random_coupling(dice, bodies));
  if (dice.one_in(3)) scene.teleport = dice.vector(10.0);
  return scene;
}

std::string failure_of(const StressScene& scene) {
  const Model model(scene.definition);
  State state = start_of(model, scene);
  Workspace workspace(model);
  const ConstantForces loads(scene.forces);
  std::vector<Coupling> couplings = scene.couplings;
  for (int k = 0; k < scene.steps; ++k) {
    if (2 * k == scene.steps) {
      for (Coupling& coupling : couplings) coupling.target_position += scene.teleport;
    }
    const StepReport report = step(model, state, workspace, {.loads = &loads, .couplings = couplings},
                                   {.step = scene.h, .order = scene.order});
    const std::string where = " in step " + std::to_string(k);
    if (report.status != StepStatus::kOk) return "not finite" + where;
    if (!report.converged) return "Newton did not converge" + where;
    if (const std::string broken = broken_rotation(state); !broken.empty()) return broken + " is not unit" + where;
    if (!std::isfinite(energy(model, state).total())) return "energy not finite" + where;
  }
  return "";
}

StressScene shrink(StressScene scene) {
  const auto try_change = [&](auto change) {
    StressScene smaller = scene;
    change(smaller);
    if (failure_of(smaller).empty()) return false;
    scene = std::move(smaller);
    return true;
  };
  const auto drop_last_body = [](StressScene& s) {
    if (s.definition.bodies.size() < 2) return;
    s.definition.bodies.pop_back();
    s.spins.pop_back();
    s.forces.pop_back();
    const int left = static_cast<int>(s.definition.bodies.size());
    std::erase_if(s.couplings, [left](const Coupling& c) { return c.body >= left; });
  };
  while (scene.definition.bodies.size() > 1 && try_change(drop_last_body)) {
  }
  try_change([](StressScene& s) { s.couplings.clear(); });
  try_change([](StressScene& s) { s.order = 1; });
  try_change([](StressScene& s) { s.definition.gravity.setZero(); });
  for (std::size_t i = 0; i < scene.forces.size(); ++i) {
    try_change([i](StressScene& s) { s.forces[i] = {}; });
    try_change([i](StressScene& s) { s.spins[i].setZero(); });
    try_change([i](StressScene& s) { s.definition.bodies[i].joint.shape = {}; });
    try_change([i](StressScene& s) { s.definition.bodies[i].joint.hardening = 0.0; });
  }
  while (scene.steps > 1 && try_change([](StressScene& s) { --s.steps; })) {
  }
  return scene;
}

void write_report(const StressScene& scene, const std::string& path) {
  std::ofstream out(path);
  out.precision(17);
  const Eigen::IOFormat row(Eigen::FullPrecision, Eigen::DontAlignCols, " ", " ");
  out << "seed " << scene.seed << "\nfails: " << failure_of(scene) << "\nh " << scene.h << " steps " << scene.steps
      << " order " << scene.order << " law " << static_cast<int>(scene.definition.law) << " root "
      << static_cast<int>(scene.definition.root) << "\n";
  for (std::size_t i = 0; i < scene.definition.bodies.size(); ++i) {
    const BodyDefinition& b = scene.definition.bodies[i];
    out << "body " << i << " parent " << b.parent << " mass " << b.mass << " anchor " << b.anchor.format(row) << " com "
        << b.com.format(row) << "\n  inertia " << b.inertia.format(row) << "\n  K " << b.joint.stiffness << " D_f "
        << b.joint.damping << " D_d " << b.joint.flow_damping << " t_y " << b.joint.yield_torque << " H "
        << b.joint.hardening << " locked " << b.joint.shape.locked[0] << b.joint.shape.locked[1]
        << b.joint.shape.locked[2] << "\n  spin " << scene.spins[i].format(row) << " force "
        << scene.forces[i].force.format(row) << "\n";
  }
  for (const Coupling& c : scene.couplings) {
    out << "coupling body " << c.body << " K " << c.stiffness << " D " << c.damping << " angular K "
        << c.angular_stiffness << "\n";
  }
}

}  // namespace layfigure::testing
