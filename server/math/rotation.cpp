#include "layfigure/math/rotation.h"

#include "layfigure/math/spatial.h"

namespace layfigure::math {

Eigen::Quaterniond exp_rotation(const Eigen::Vector3d& v) {
  return lane(exp_rotation(Vec3<double>{v.x(), v.y(), v.z()}), 0);
}

Eigen::Vector3d log_rotation(const Eigen::Quaterniond& q) {
  return lane(log_rotation(Quat<double>{q.w(), q.x(), q.y(), q.z()}), 0);
}

}  // namespace layfigure::math
