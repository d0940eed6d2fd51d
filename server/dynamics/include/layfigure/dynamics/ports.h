#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <span>

#include "layfigure/dynamics/model.h"
#include "layfigure/dynamics/state.h"
#include "layfigure/dynamics/step.h"

/// What a step tells of the doll at a few points that are held: how these ports answer to wrenches, together. It is
/// what runs between steps where a hand is served faster than the whole doll is stepped (haptics/local_dynamics.h).
///
/// A port is a point of a body with its six directions; J maps the joints' velocities to those of all ports [angular;
/// linear of the point], world axes. The step solves (M + h D + h^2 K) w = momenta + h forces subject to its acting
/// constraint rows G of compliance S, K and D the joints' tangents in the regimes that the step ended in: a joint that
/// flows has no stiffness, and its damping is the flow's. So an impulse i at the ports changes their velocities by A i,
///     A = J [P - P G^T (G P G^T + S)^-1 G P] J^T,    P = (M + h D + h^2 K)^-1
/// Acting rows are those that exert something: a contact's normal, its tangents while it sticks, a bound of a joint,
/// the rows of a tie that are not at their bounds. Redundant rows are passed over.
///
/// The same with P = (M + h D)^-1 and P = M^-1 tells the three effects apart: by how much the doll resists as a mass,
/// as a damper and as a spring. These matrices fall in this order, each being less than the one before in the sense of
/// quadratic forms, since adding a positive semidefinite matrix to what is inverted can only lessen the inverse. What
/// holds the doll beside its joints (couplings, drives) counts as a spring; axes that are rigid stay so in all three.
namespace layfigure::dynamics {

struct Port {
  int body{0};
  Eigen::Vector3d point{Eigen::Vector3d::Zero()};  ///< in the body's frame [m]
};

class PortResponse {
 public:
  explicit PortResponse(const Model& model);
  ~PortResponse();
  PortResponse(PortResponse&&) noexcept;
  PortResponse& operator=(PortResponse&&) noexcept;

  /// Takes the response from the last step of the workspace, of any order: from the factors of its finest run's last
  /// part. `before`: the state that the step began with. False, and nothing is changed, where the workspace has
  /// no factors: before the first step, after another measure() of the same step, or where bodies have just fallen
  /// asleep.
  ///
  /// O(path) for A, two eliminations of the whole tree for the other two matrices, O(r (r + p)^2) for r acting rows and
  /// p port rows. Uses up the workspace's factors; the next step makes its own. Allocates only where there are more
  /// ports, rows or bodies on the paths than ever before.
  [[nodiscard]] bool measure(const Model& model, const State& before, Workspace& workspace, double step_length,
                             std::span<const Port> ports);

  [[nodiscard]] int ports() const;
  /// A: velocity [rad/s, m/s] by impulse [N m s, N s], 6 rows for each port; symmetric.
  [[nodiscard]] const Eigen::MatrixXd& matrix() const;
  /// The same of (M + h D)^-1 ...
  [[nodiscard]] const Eigen::MatrixXd& damped_matrix() const;
  /// ... and of M^-1.
  [[nodiscard]] const Eigen::MatrixXd& inertial_matrix() const;
  /// Length h of the step, or of the last part of it, that A belongs to [s].
  [[nodiscard]] double factor_length() const;

  /// At the step's beginning, world: R_WB of port k's body, and where its point is.
  [[nodiscard]] const Eigen::Quaterniond& rotation(int k) const;
  [[nodiscard]] const Eigen::Vector3d& position(int k) const;
  /// [angular; linear] of all ports at its beginning ...
  [[nodiscard]] const Eigen::VectorXd& velocity() const;
  /// ... and their mean accelerations in it, with all that acted.
  [[nodiscard]] const Eigen::VectorXd& acceleration() const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace layfigure::dynamics
