#include "dense_step.h"

#include "layfigure/math/rotation.h"

namespace layfigure::testing {
namespace {

using namespace dynamics;

Eigen::MatrixXd jacobian(const Model& model, const std::vector<BodyPose>& poses) {
  const int n = model.size();
  const bool free = model.root() == RootKind::kFree;
  int roots = 0;
  for (int i = 0; i < n && free; ++i) roots += model.body(i).parent < 0 ? 1 : 0;
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(6 * n, 3 * (n + roots));
  std::vector<int> root_of(n);
  int next_root = n;
  for (int i = 0; i < n; ++i) {
    const int parent = model.body(i).parent;
    root_of[i] = parent < 0 ? next_root++ : root_of[parent];
    if (free) J.block<3, 3>(6 * i + 3, 3 * root_of[i]).setIdentity();
    for (int j = i; j >= 0; j = model.body(j).parent) {
      const Eigen::Matrix3d R = poses[j].rotation.toRotationMatrix();
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector3d axis = R.col(k);
        J.block<3, 1>(6 * i, 3 * j + k) = axis;
        J.block<3, 1>(6 * i + 3, 3 * j + k) = axis.cross(poses[i].com - poses[j].origin);
      }
    }
  }
  return J;
}

}  // namespace

DenseStep dense_step(const Model& model, const State& state, double h) {
  const int n = model.size();
  DenseStep dense;
  world_poses(model, state, dense.poses);
  const Eigen::MatrixXd& J = dense.jacobian = jacobian(model, dense.poses);
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(6 * n, 6 * n);
  Eigen::VectorXd P(6 * n);
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(J.cols(), J.cols());
  Eigen::VectorXd elastic = Eigen::VectorXd::Zero(J.cols());
  for (int i = 0; i < n; ++i) {
    const BodyDefinition& body = model.body(i);
    const Eigen::Matrix3d R = dense.poses[i].rotation.toRotationMatrix();
    M.block<3, 3>(6 * i, 6 * i) = R * body.inertia * R.transpose();
    M.block<3, 3>(6 * i + 3, 6 * i + 3) = body.mass * Eigen::Matrix3d::Identity();
    P.segment<3>(6 * i) = state.bodies[i].angular_momentum;
    P.segment<3>(6 * i + 3) = state.bodies[i].linear_momentum + h * body.mass * model.gravity();
    if (body.parent < 0 && model.root() == RootKind::kFree) continue;
    const JointLaw& law = body.joint;
    const auto strain = math::log_rotation(state.bodies[i].rest_rotation.conjugate() * state.bodies[i].rotation);
    const Eigen::Matrix3d S = law.shape.axes.toRotationMatrix();
    const Eigen::Matrix3d K = S * (law.stiffness * law.shape.stiffness).asDiagonal() * S.transpose();
    const Eigen::Matrix3d D = S * (law.damping * law.shape.damping).asDiagonal() * S.transpose();
    G.block<3, 3>(3 * i, 3 * i) = h * (h * K + D);
    elastic.segment<3>(3 * i) = -h * K * strain;
  }
  dense.matrix = J.transpose() * M * J + G;
  dense.right = J.transpose() * P + elastic;
  return dense;
}

}  // namespace layfigure::testing
