#include "layfigure/session/mirror.h"

#include <algorithm>
#include <stdexcept>

namespace layfigure::session {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

class Plane {
 public:
  explicit Plane(const doll::Doll& doll) : doll_(doll) {}

  [[nodiscard]] Vector3d reflected(const Vector3d& v) const {
    return v - 2.0 * doll_.mirror_normal.dot(v) * doll_.mirror_normal;
  }
  /// S R S: about the reflected axis, the other way round.
  [[nodiscard]] Quaterniond reflected(const Quaterniond& q) const {
    const Vector3d axis = -reflected(Vector3d(q.vec()));
    return {q.w(), axis.x(), axis.y(), axis.z()};
  }
  [[nodiscard]] bool is_left(int body) const {
    return doll_.mirror_normal.dot(bind(body).translation()) > doll_.mirror_offset;
  }
  [[nodiscard]] const Eigen::Isometry3d& bind(int body) const { return doll_.rig.bones[doll_.bone_of_body[body]].bind; }
  /// R0 of a body, of the world's for a root's parent.
  [[nodiscard]] Quaterniond bind_rotation(int body) const {
    return body < 0 ? Quaterniond::Identity() : Quaterniond(bind(body).linear()).normalized();
  }
  /// What `rotation` of the joint of `from` is for that of its image `to`.
  [[nodiscard]] Quaterniond image(const Quaterniond& rotation, int from, int to) const {
    const auto& bodies = doll_.definition.bodies;
    const Quaterniond relative = bind_rotation(bodies[from].parent) * rotation * bind_rotation(from).conjugate();
    return (bind_rotation(bodies[to].parent).conjugate() * reflected(relative) * bind_rotation(to)).normalized();
  }

 private:
  const doll::Doll& doll_;
};

bool changes(const doll::Doll& doll, const Plane& plane, int body, MirrorSide side) {
  const int image = doll.mirror_of_body[body];
  const auto& locked = doll.definition.bodies[body].joint.shape.locked;
  if (image < 0 || std::ranges::all_of(locked, [](bool axis) { return axis; })) return false;
  if (side == MirrorSide::kBoth) return true;
  return image != body && plane.is_left(body) == (side == MirrorSide::kRight);
}

void require_pairs(const doll::Doll& doll) {
  for (std::size_t body = 0; body < doll.mirror_of_body.size(); ++body) {
    const int image = doll.mirror_of_body[body];
    if (image >= 0 && image != static_cast<int>(body)) return;
  }
  throw std::invalid_argument("the doll has no left and right: no two of its bodies mirror each other");
}

}  // namespace

haptics::DollMemory mirrored(const doll::Doll& doll, const haptics::DollMemory& memory, MirrorSide side) {
  require_pairs(doll);
  const Plane plane(doll);
  haptics::DollMemory result = memory;
  for (int body = 0; body < static_cast<int>(memory.joints.size()); ++body) {
    if (!changes(doll, plane, body, side)) continue;
    const int from = doll.mirror_of_body[body];
    const haptics::JointMemory& seen = memory.joints[from];
    haptics::JointMemory& joint = result.joints[body];
    joint.rotation = plane.image(seen.rotation, from, body);
    joint.rest_rotation = plane.image(seen.rest_rotation, from, body);
    joint.flow = seen.flow;
    joint.torque.setZero();
    if (doll.definition.bodies[body].parent >= 0) continue;
    const Vector3d moved = seen.position - plane.bind(from).translation();
    joint.position = plane.bind(body).translation() + plane.reflected(moved);
  }
  return result;
}

}  // namespace layfigure::session
