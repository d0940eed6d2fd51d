#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "layfigure/dynamics/lcp.h"
#include "layfigure/scene/scene.h"

/// The complementarity problems that the contacts of real scenes make.
namespace layfigure::bench {

struct FallingScene {
  std::string name;
  scene::SceneDefinition definition;
  double settling;  ///< until it lies still, or nearly so [s]
};

/// A ball, piles of cubes, a doll and a heap of dolls on the floor: from few contacts to many.
[[nodiscard]] std::vector<FallingScene> falling_scenes();

/// A scene whose contacts carry what lies on them.
struct RestingScene {
  std::string name;
  scene::SceneDefinition definition;
  dynamics::State state;
};

[[nodiscard]] RestingScene settled(const FallingScene& falling);

/// v = A lambda + b, law by law. A contact is three rows with friction, one without.
struct ContactProblem {
  Eigen::MatrixXd delassus;
  Eigen::VectorXd bias;
  std::vector<dynamics::LcpRow> rows;
  std::vector<std::uint64_t> keys;  ///< of the contacts, in the order of their rows
  [[nodiscard]] int size() const { return static_cast<int>(rows.size()); }
};

/// The problems of the next `steps` steps, of all contacts that the scene's shapes make in each: those that may close
/// within the step among them. Computed densely.
[[nodiscard]] std::vector<ContactProblem> contact_problems(const RestingScene& resting, int steps);

/// The same contacts without friction.
[[nodiscard]] ContactProblem frictionless(const ContactProblem& problem);

/// Where to look for `next`'s impulses: those of the same contacts in `last`, zero for new ones.
[[nodiscard]] Eigen::VectorXd warm_start(const ContactProblem& last, const Eigen::VectorXd& impulses,
                                         const ContactProblem& next);

/// How far impulses are from the rows' laws: the relative complementarity residual of lcp.h, for rows without friction.
[[nodiscard]] double unilateral_residual(const ContactProblem& problem, const Eigen::VectorXd& impulses);

}  // namespace layfigure::bench
