#include "layfigure/haptics/pose_rate.h"

#include "layfigure/math/rotation.h"

namespace layfigure::haptics {

void PoseRate::follow(const PointerPose& from, const PointerPose& to, double h) {
  const double share = h / (h + kVelocitySmoothing);
  linear += share * ((to.position - from.position) / h - linear);
  const Eigen::Vector3d turn = math::log_rotation(to.rotation * from.rotation.conjugate());
  angular += share * (turn / h - angular);
}

}  // namespace layfigure::haptics
