#include "person_fixture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "layfigure/dynamics/limits.h"
#include "layfigure/math/rotation.h"

namespace layfigure::doll::test {
namespace {

using character::Bone;
using character::Rig;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr int kSides = 8;
constexpr double kApart = 0.02;  // share of the length: no two limbs share vertices

/// Adds limbs by name, remembering the last; each bone's roll is larger than the one before.
class Builder {
 public:
  Builder(Rig& rig, const Person& person) : rig_(rig), person_(person) {}

  int add(const std::string& name, int parent, const Vector3d& head, const Vector3d& tail, double radius) {
    roll_ += person_.roll;
    return add_limb(rig_, name, parent, person_.scale * head, person_.scale * tail, person_.scale * radius, roll_);
  }

 private:
  Rig& rig_;
  const Person& person_;
  double roll_{0.0};
};

void add_finger(Builder& builder, const std::string& name, int hand, Vector3d base, const Vector3d& direction) {
  int parent = hand;
  for (const auto& [segment, length] : {std::pair(1, 0.04), std::pair(2, 0.026), std::pair(3, 0.02)}) {
    const Vector3d tip = base + length * direction;
    parent = builder.add(name + std::to_string(segment), parent, base, tip, 0.008);
    base = tip;
  }
}

void add_arm(Builder& builder, const Person& person, const std::string& side, double x, int chest) {
  const Vector3d along(x * std::cos(person.arm_slope), 0, -std::sin(person.arm_slope));
  const Vector3d forward(0, -1, 0);
  const Vector3d shoulder(x * 0.17, 0, 1.45);
  const auto at = [&](double distance) { return Vector3d(shoulder + distance * along); };
  const int clavicle = builder.add(side + "Shoulder", chest, {x * 0.03, 0, 1.45}, shoulder, 0.04);
  const int arm = builder.add(side + "Arm", clavicle, at(0), at(0.28), 0.045);
  const int forearm = builder.add(side + "ForeArm", arm, at(0.28), at(0.53), 0.04);
  const int hand = builder.add(side + "Hand", forearm, at(0.53), at(0.62), 0.03);
  if (!person.fingers) return;
  add_finger(builder, side + "HandThumb", hand, at(0.55) + 0.03 * forward,
             (std::numbers::sqrt2 / 2) * (along + forward));
  double y = 0.03;
  for (const char* finger : {"Index", "Middle", "Ring", "Pinky"}) {
    add_finger(builder, side + "Hand" + finger, hand, at(0.63) + y * forward, along);
    y -= 0.02;
  }
}

void add_leg(Builder& builder, const std::string& side, double x, int hips) {
  const Vector3d hip(x * 0.1, 0, 0.95);
  const Vector3d knee(x * 0.1, 0, 0.52);
  const Vector3d ankle(x * 0.1, 0.02, 0.09);
  const Vector3d ball(x * 0.1, -0.10, 0.03);
  const int thigh = builder.add(side + "UpLeg", hips, hip, knee, 0.07);
  const int shin = builder.add(side + "Leg", thigh, knee, ankle, 0.05);
  const int foot = builder.add(side + "Foot", shin, ankle, ball, 0.035);
  builder.add(side + "ToeBase", foot, ball, {x * 0.1, -0.17, 0.025}, 0.02);
}

}  // namespace

int add_limb(Rig& rig, const std::string& name, int parent, const Vector3d& head, const Vector3d& tail, double radius,
             double roll) {
  const Vector3d y = (tail - head).normalized();
  const Vector3d side = (std::abs(y.z()) < 0.9 ? Vector3d::UnitZ() : Vector3d::UnitY()).cross(y).normalized();
  Bone bone;
  bone.name = name;
  bone.parent = parent;
  Matrix3d axes;
  axes << side, y, side.cross(y);
  bone.bind.linear() = axes * Eigen::AngleAxisd(roll, Vector3d::UnitY());
  bone.bind.translation() = head;
  bone.rest = parent < 0 ? bone.bind : rig.bones[parent].bind.inverse() * bone.bind;
  const int index = static_cast<int>(rig.bones.size());
  rig.bones.push_back(bone);

  character::SkinnedMesh mesh;
  mesh.name = name;
  const Vector3d apart = kApart * (tail - head);
  for (const Vector3d& end : {Vector3d(head + apart), Vector3d(tail - apart)}) {
    for (int k = 0; k < kSides; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / kSides;
      mesh.vertices.push_back(end + radius * (std::cos(angle) * side + std::sin(angle) * y.cross(side)));
    }
  }
  for (int k = 0; k < kSides; ++k) {
    const int next = (k + 1) % kSides;
    mesh.triangles.emplace_back(k, next, kSides + next);
    mesh.triangles.emplace_back(k, kSides + next, kSides + k);
    if (k == 0 || next == 0) continue;
    mesh.triangles.emplace_back(0, next, k);
    mesh.triangles.emplace_back(kSides, kSides + k, kSides + next);
  }
  mesh.influences.assign(mesh.vertices.size(), {{index, 1.0}});
  rig.meshes.push_back(mesh);
  return index;
}

Rig make_person(const Person& person) {
  Rig rig;
  rig.name = "person";
  rig.source_file = "person.glb";
  Builder builder(rig, person);
  const int hips = builder.add("Hips", -1, {0, 0, 0.95}, {0, 0, 1.08}, 0.13);
  const int spine = builder.add(person.spine, hips, {0, 0, 1.08}, {0, 0, 1.25}, 0.12);
  const int chest = builder.add("Chest", spine, {0, 0, 1.25}, {0, 0, 1.49}, 0.14);
  const int neck = builder.add("Neck", chest, {0, 0, 1.49}, {0, 0, 1.58}, 0.05);
  builder.add("Head", neck, {0, 0, 1.58}, {0, 0, 1.8}, 0.09);
  for (const double x : {1.0, -1.0}) {
    const std::string side = x > 0 ? "Left" : "Right";
    add_arm(builder, person, side, x, chest);
    add_leg(builder, side, x, hips);
  }
  return rig;
}

Rig reflected(const Rig& rig) {
  const Matrix3d S = Vector3d(-1, 1, 1).asDiagonal();
  Rig image = rig;
  for (std::size_t b = 0; b < rig.bones.size(); ++b) {
    Bone& bone = image.bones[b];
    bone.bind.linear() = S * rig.bones[b].bind.linear() * S;
    bone.bind.translation() = S * rig.bones[b].bind.translation();
    bone.rest.linear() = S * rig.bones[b].rest.linear() * S;
    bone.rest.translation() = S * rig.bones[b].rest.translation();
  }
  for (auto& mesh : image.meshes) {
    for (auto& vertex : mesh.vertices) vertex = S * vertex;
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  }
  return image;
}

int body_called(const Doll& doll, const std::string& name) {
  for (std::size_t b = 0; b < doll.definition.bodies.size(); ++b) {
    if (doll.definition.bodies[b].name == name) return static_cast<int>(b);
  }
  throw std::invalid_argument("no body '" + name + "'");
}

double gap(const Doll& doll, int body, const Vector3d& turn) {
  const int parent = doll.definition.bodies[body].parent;
  const auto bind = [&](int b) { return Quaterniond(doll.rig.bones[doll.bone_of_body[b]].bind.linear()); };
  const Quaterniond rotation = bind(parent).conjugate() * math::exp_rotation(turn) * bind(body);
  const dynamics::LimitState state = limit_state(doll.definition.bodies[body].limits, rotation.normalized());
  return std::min({state.lower_twist.gap, state.upper_twist.gap, state.swing.gap});
}

bool allows(const Doll& doll, const std::string& name, const Vector3d& axis, double angle_deg) {
  return gap(doll, body_called(doll, name), axis * angle_deg * std::numbers::pi / 180.0) > 0.0;
}

}  // namespace layfigure::doll::test
