#include "contact_problem.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <numbers>

#include "dense_step.h"
#include "layfigure/dynamics/constraints.h"
#include "touching_scenes.h"

namespace layfigure::bench {
namespace {

using collision::ContactPoint;
using dynamics::LcpRow;

constexpr double kStep = 2e-3;
// For which a scene is stepped before its contacts count [s]: stacks begin at rest, dolls fall.
constexpr double kStackSettling = 0.2;
constexpr double kDollSettling = 2.0;
constexpr double kElastic = std::numeric_limits<double>::infinity();

scene::SceneDefinition ball() {
  scene::SceneDefinition definition = testing::stack(1, 0.0, 0.5);
  definition.shapes.back().shape = collision::Sphere{.radius = 0.05};
  return definition;
}

/// Dolls on their backs that fall onto each other.
scene::SceneDefinition heap(int dolls) {
  scene::SceneDefinition heap;
  for (int k = 0; k < dolls; ++k) {
    scene::SceneDefinition doll = testing::capsule_doll(0.2 + 0.2 * k, kElastic);
    const int first = static_cast<int>(heap.model.bodies.size());
    const auto shift = [first](int body) { return body < 0 ? body : body + first; };
    doll.model.bodies.front().rotation = Eigen::AngleAxisd(0.5 * std::numbers::pi, Eigen::Vector3d::UnitX());
    doll.model.bodies.front().anchor += Eigen::Vector3d(0.05 * k, 0.05 * k, 0.0);
    for (dynamics::BodyDefinition& body : doll.model.bodies) {
      body.parent = shift(body.parent);
      body.limits = {};
      heap.model.bodies.push_back(body);
    }
    for (collision::ShapeDefinition& shape : doll.shapes) {
      const bool floor = shape.body == collision::kWorldBody;
      shape.body = shift(shape.body);
      if (!floor || k == 0) heap.shapes.push_back(shape);
    }
    for (const auto& [a, b] : doll.excluded) heap.excluded.emplace_back(shift(a), shift(b));
    heap.model.root = doll.model.root;
  }
  return heap;
}

/// Normal and two tangents, the same ones for the same normal.
Eigen::Matrix3d directions(const Eigen::Vector3d& normal) {
  Eigen::Matrix3d directions;
  directions.col(0) = normal;
  directions.col(1) = normal.unitOrthogonal();
  directions.col(2) = normal.cross(directions.col(1));
  return directions;
}

/// Velocity of a body's point, a row for each of the world's axes, from the joints' velocities.
Eigen::MatrixXd point_jacobian(const testing::DenseStep& dense, int body, const Eigen::Vector3d& point) {
  if (body == collision::kWorldBody) return Eigen::MatrixXd::Zero(3, dense.jacobian.cols());
  const Eigen::Vector3d r = point - dense.poses[body].com;
  Eigen::Matrix3d cross;
  cross << 0.0, -r.z(), r.y(), r.z(), 0.0, -r.x(), -r.y(), r.x(), 0.0;
  return dense.jacobian.middleRows(6 * body + 3, 3) - cross * dense.jacobian.middleRows(6 * body, 3);
}

std::uint64_t key_of(const ContactPoint& point) {
  const auto pair = static_cast<std::uint64_t>(point.shape_a) << 16 | static_cast<std::uint64_t>(point.shape_b);
  return pair << 32 ^ point.feature;
}

ContactProblem problem_of(std::span<const ContactPoint> contacts, const testing::DenseStep& dense) {
  ContactProblem problem;
  const int rows = 3 * static_cast<int>(contacts.size());
  Eigen::MatrixXd J(rows, dense.jacobian.cols());
  problem.bias.resize(rows);
  problem.bias.setZero();
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const ContactPoint& point = contacts[k];
    const int row = 3 * static_cast<int>(k);
    J.middleRows(row, 3) = directions(point.normal_W).transpose() * (point_jacobian(dense, point.body_a, point.p_Wa) -
                                                                     point_jacobian(dense, point.body_b, point.p_Wb));
    problem.bias[row] = point.gap / (point.gap > 0.0 ? kStep : kStep + dynamics::kRecoveryTime);
    problem.keys.push_back(key_of(point));
    problem.rows.insert(problem.rows.end(), {LcpRow::contact(point.friction), LcpRow::tangent(), LcpRow::tangent()});
  }
  const Eigen::LLT<Eigen::MatrixXd> factor(dense.matrix);
  problem.delassus = J * factor.solve(J.transpose());
  problem.bias += J * factor.solve(dense.right);
  return problem;
}

}  // namespace

std::vector<FallingScene> falling_scenes() {
  const auto stack = [](int cubes) {
    return FallingScene{"stack of " + std::to_string(cubes), testing::stack(cubes, 0.0, 0.5), kStackSettling};
  };
  return {{"ball", ball(), kStackSettling},
          stack(1),
          stack(2),
          {"doll", heap(1), kDollSettling},
          stack(5),
          {"heap of 4 dolls", heap(4), kDollSettling},
          stack(10),
          stack(25)};
}

RestingScene settled(const FallingScene& falling) {
  scene::Scene scene(falling.definition);
  dynamics::State state = dynamics::initial_state(scene.model());
  for (int n = 0; n * kStep < falling.settling; ++n) (void)scene.step(state, {}, {.step = kStep});
  return {falling.name, falling.definition, state};
}

std::vector<ContactProblem> contact_problems(const RestingScene& resting, int steps) {
  scene::Scene scene(resting.definition);
  dynamics::State state = resting.state;
  std::vector<ContactProblem> problems;
  for (int k = 0; k < steps; ++k) {
    const testing::DenseStep dense = testing::dense_step(scene.model(), state, kStep);
    (void)scene.step(state, {}, {.step = kStep});
    problems.push_back(problem_of(scene.contacts(), dense));
  }
  return problems;
}

ContactProblem frictionless(const ContactProblem& problem) {
  const int contacts = static_cast<int>(problem.keys.size());
  const auto normals = Eigen::seqN(0, contacts, 3);
  return {.delassus = problem.delassus(normals, normals),
          .bias = problem.bias(normals),
          .rows = std::vector<LcpRow>(contacts, LcpRow::unilateral()),
          .keys = problem.keys};
}

Eigen::VectorXd warm_start(const ContactProblem& last, const Eigen::VectorXd& impulses, const ContactProblem& next) {
  Eigen::VectorXd start = Eigen::VectorXd::Zero(next.size());
  if (last.keys.empty()) return start;
  const Eigen::Index rows = last.size() / static_cast<Eigen::Index>(last.keys.size());
  for (std::size_t k = 0; k < next.keys.size(); ++k) {
    const auto same = std::find(last.keys.begin(), last.keys.end(), next.keys[k]);
    if (same == last.keys.end()) continue;
    start.segment(rows * static_cast<Eigen::Index>(k), rows) =
        impulses.segment(rows * (same - last.keys.begin()), rows);
  }
  return start;
}

double unilateral_residual(const ContactProblem& problem, const Eigen::VectorXd& impulses) {
  const Eigen::ArrayXd scale = problem.delassus.diagonal().array().rsqrt();
  const Eigen::ArrayXd velocity = scale * (problem.delassus * impulses + problem.bias).array();
  const Eigen::ArrayXd impulse = impulses.array() / scale;
  return (impulse - (impulse - velocity).max(0.0)).abs().maxCoeff() / (scale * problem.bias.array()).abs().maxCoeff();
}

}  // namespace layfigure::bench
