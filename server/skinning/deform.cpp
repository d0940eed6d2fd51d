#include "layfigure/skinning/deform.h"

#include <cassert>
#include <cmath>
#include <vector>

#include "layfigure/math/kernel.h"
#include "layfigure/math/lanes.h"

namespace layfigure::skinning {
namespace {

using character::Influence;
using Eigen::Isometry3d;
using Eigen::Vector3d;
using math::Lanes4;

/// The upper three rows of a homogeneous matrix by its columns, the fourth lane unused: M v = x v_x + y v_y + z v_z +
/// t.
struct Columns {
  Lanes4 x, y, z, t;
};

/// Quaternions in the order w x y z. Of a motion (R, t): real = q(R), dual = (0, t) q(R) / 2.
struct DualQuaternion {
  Lanes4 real, dual;
};

Lanes4 lanes(double a, double b, double c, double d) { return Lanes4(Lanes4::Vector{a, b, c, d}); }
Lanes4 lanes(const Vector3d& v) { return lanes(v.x(), v.y(), v.z(), 0.0); }
Lanes4 lanes(const Eigen::Quaterniond& q) { return lanes(q.w(), q.x(), q.y(), q.z()); }
Vector3d first_three(const Lanes4& l) { return {l.v[0], l.v[1], l.v[2]}; }
Vector3d last_three(const Lanes4& l) { return {l.v[1], l.v[2], l.v[3]}; }

Columns columns_of(const Isometry3d& M) {
  return {lanes(M.linear().col(0)), lanes(M.linear().col(1)), lanes(M.linear().col(2)), lanes(M.translation())};
}

DualQuaternion dual_quaternion_of(const Isometry3d& M) {
  const Eigen::Quaterniond real = Eigen::Quaterniond(M.linear()).normalized();
  Eigen::Quaterniond half(0, 0, 0, 0);
  half.vec() = 0.5 * M.translation();
  return {lanes(real), lanes(half * real)};
}

Columns scaled(const Lanes4& s, const Columns& a) { return {s * a.x, s * a.y, s * a.z, s * a.t}; }
Columns sum(const Columns& a, const Columns& b) { return {a.x + b.x, a.y + b.y, a.z + b.z, a.t + b.t}; }
DualQuaternion scaled(const Lanes4& s, const DualQuaternion& a) { return {s * a.real, s * a.dual}; }
DualQuaternion sum(const DualQuaternion& a, const DualQuaternion& b) { return {a.real + b.real, a.dual + b.dual}; }

Vector3d unit_or_zero(const Vector3d& v) {
  const double length = v.norm();
  return length > 0.0 ? Vector3d(v / length) : v;
}

/// sum w_b M_b.
struct LinearBlend {
  using Motion = Columns;

  static Columns blend(std::span<const Influence> influences, const Columns* motions) {
    Columns blended = scaled(influences[0].weight, motions[influences[0].bone]);
    for (std::size_t k = 1; k < influences.size(); ++k) {
      blended = sum(blended, scaled(influences[k].weight, motions[influences[k].bone]));
    }
    return blended;
  }

  static Vector3d rotated(const Columns& M, const Vector3d& v) {
    return first_three(M.x * v.x() + M.y * v.y() + M.z * v.z());
  }
  static Vector3d moved(const Columns& M, const Vector3d& v) {
    return first_three(M.x * v.x() + M.y * v.y() + M.z * v.z() + M.t);
  }
};

/// d / |d|, d = sum s_b w_b q_b. The sum cannot vanish: no term of it points away from the heaviest.
struct DualQuaternionBlend {
  using Motion = DualQuaternion;

  static DualQuaternion blend(std::span<const Influence> influences, const DualQuaternion* motions) {
    const DualQuaternion& heaviest = motions[influences[0].bone];
    DualQuaternion blended = scaled(influences[0].weight, heaviest);
    for (std::size_t k = 1; k < influences.size(); ++k) {
      const DualQuaternion& motion = motions[influences[k].bone];
      const bool opposite = math::total(heaviest.real * motion.real) < 0.0;
      blended = sum(blended, scaled(opposite ? -influences[k].weight : influences[k].weight, motion));
    }
    return scaled(1.0 / std::sqrt(math::total(blended.real * blended.real)), blended);
  }

  static Vector3d rotated(const DualQuaternion& d, const Vector3d& v) {
    const Vector3d axis = last_three(d.real);
    return v + 2.0 * axis.cross(axis.cross(v) + d.real.v[0] * v);
  }
  /// The translation is the vector part of 2 dual real*; what the blend has added to its scalar part is left out.
  static Vector3d moved(const DualQuaternion& d, const Vector3d& v) {
    const Vector3d axis = last_three(d.real);
    const Vector3d dual = last_three(d.dual);
    return rotated(d, v) + 2.0 * (d.real.v[0] * dual - d.dual.v[0] * axis + axis.cross(dual));
  }
};

template <class Kind>
void deform_vertices(const Skin& skin, const typename Kind::Motion* motions, std::span<Vector3d> positions,
                     std::span<Vector3d> normals) {
  const std::span<const Vector3d> bind_positions = skin.bind_positions();
  const std::span<const Vector3d> bind_normals = skin.bind_normals();
  for (int v = 0; v < skin.vertex_count(); ++v) {
    const typename Kind::Motion motion = Kind::blend(skin.influences(v), motions);
    positions[v] = Kind::moved(motion, bind_positions[v]);
    if (!normals.empty()) normals[v] = unit_or_zero(Kind::rotated(motion, bind_normals[v]));
  }
}

LAYFIGURE_KERNEL void deform_linear(const Skin& skin, const Columns* motions, std::span<Vector3d> positions,
                                    std::span<Vector3d> normals) {
  deform_vertices<LinearBlend>(skin, motions, positions, normals);
}

LAYFIGURE_KERNEL void deform_dual_quaternion(const Skin& skin, const DualQuaternion* motions,
                                             std::span<Vector3d> positions, std::span<Vector3d> normals) {
  deform_vertices<DualQuaternionBlend>(skin, motions, positions, normals);
}

}  // namespace

/// Of every bone: from where its skin is bound to where it is.
struct BoneMotions {
  std::vector<Isometry3d> inverse_binds;
  std::vector<Columns> linear;
  std::vector<DualQuaternion> dual_quaternion;
};

DeformWorkspace::DeformWorkspace(const Skin& skin) : motions_(std::make_unique<BoneMotions>()) {
  for (const character::Bone& bone : skin.bones()) motions_->inverse_binds.push_back(bone.bind.inverse());
  motions_->linear.resize(skin.bones().size());
  motions_->dual_quaternion.resize(skin.bones().size());
}
DeformWorkspace::~DeformWorkspace() = default;
DeformWorkspace::DeformWorkspace(DeformWorkspace&&) noexcept = default;
DeformWorkspace& DeformWorkspace::operator=(DeformWorkspace&&) noexcept = default;

void deform(const Skin& skin, std::span<const Isometry3d> X_WB, Blend blend, DeformWorkspace& workspace,
            std::span<Vector3d> positions, std::span<Vector3d> normals) {
  BoneMotions& motions = *workspace.motions_;
  assert(X_WB.size() == skin.bones().size() && motions.linear.size() == X_WB.size());
  assert(positions.size() == skin.bind_positions().size());
  assert(normals.empty() || normals.size() == positions.size());
  for (std::size_t b = 0; b < X_WB.size(); ++b) {
    const Isometry3d motion = X_WB[b] * motions.inverse_binds[b];
    if (blend == Blend::kLinear) {
      motions.linear[b] = columns_of(motion);
    } else {
      motions.dual_quaternion[b] = dual_quaternion_of(motion);
    }
  }
  if (blend == Blend::kLinear) {
    deform_linear(skin, motions.linear.data(), positions, normals);
  } else {
    deform_dual_quaternion(skin, motions.dual_quaternion.data(), positions, normals);
  }
}

}  // namespace layfigure::skinning
