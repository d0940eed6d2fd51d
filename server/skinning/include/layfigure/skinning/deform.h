#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <span>

#include "layfigure/skinning/skin.h"

namespace layfigure::skinning {

/// How the motions of a vertex's bones are blended. M_b = X_WB X_WB,bind^-1 moves what is bound to bone b, q_b is the
/// unit dual quaternion of M_b, w_b its weight on the vertex.
enum class Blend {
  /// v' = sum w_b M_b v: what Matsunaga & Hasegawa skin with, and USD's "classicLinear". Where bones twist against each
  /// other the skin gets thinner, at half a turn to nothing.
  kLinear,
  /// v' by the motion d / |d|, d = sum s_b w_b q_b, where s_b = -1 if q_b and the heaviest bone's are more than 90
  /// degrees apart, else 1 (Kavan, Collins, Zara & O'Sullivan 2008, "Geometric skinning with approximate dual
  /// quaternion blending", ACM TOG 27(4); the sign as in their section 4.1, against the heaviest bone), USD's
  /// "dualQuaternion". A rigid motion at each vertex: twists keep the skin's thickness.
  kDualQuaternion,
};

struct BoneMotions;

/// Scratch of deform(). One per thread.
class DeformWorkspace {
 public:
  explicit DeformWorkspace(const Skin& skin);
  ~DeformWorkspace();
  DeformWorkspace(DeformWorkspace&&) noexcept;
  DeformWorkspace& operator=(DeformWorkspace&&) noexcept;

 private:
  friend void deform(const Skin&, std::span<const Eigen::Isometry3d>, Blend, DeformWorkspace&,
                     std::span<Eigen::Vector3d>, std::span<Eigen::Vector3d>);
  std::unique_ptr<BoneMotions> motions_;
};

/// Moves the skin with its bones, whose poses in the world are `X_WB`, one per bone, rigid and finite. Writes one
/// position per vertex [m], and one unit normal unless `normals` is empty: the bind normal turned by the blended motion
/// (0 where a linear blend has collapsed).
///
/// Allocates nothing. O(bones + influences); per vertex of a human 8 ns linear and 43 ns by dual quaternions, with
/// normals 17 and 55 ns (2.5 GHz Xeon with AVX-512). The same bits on every instruction set.
void deform(const Skin& skin, std::span<const Eigen::Isometry3d> X_WB, Blend blend, DeformWorkspace& workspace,
            std::span<Eigen::Vector3d> positions, std::span<Eigen::Vector3d> normals = {});

}  // namespace layfigure::skinning
