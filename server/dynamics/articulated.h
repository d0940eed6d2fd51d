#pragma once

#include "run.h"

/// The O(n) articulated-body recursion in world axes, each block with its origin at its body's joint.
///
/// With articulated inertia [[A, H], [H^T, M]], momentum target (b_a, b_l), gain G = h dt/dw and residual r:
///     X = (A + G)^-1,   y = X (b_a + r),   P = X G,   B = X H
///     to the parent:  A' = A P,   H' = G B,   M' = M - H^T B,   b_a' = G y - r,   b_l' = b_l - H^T y
///     velocity:       w_WB = y + P W - B V
/// These forms keep every digit for a small gain, where A - A X A would cancel, and A', M' are kept as six numbers, so
/// that rounding cannot make them unsymmetric. Featherstone, Rigid Body Dynamics Algorithms, ch. 7, with momenta in
/// place of accelerations.
namespace layfigure::dynamics {

/// The matrix g 1: products with it cost a third of those with a general symmetric matrix.
template <class T>
struct Isotropic {
  T g;
};
template <class T>
inline Vec3<T> operator*(const Isotropic<T>& gain, const Vec3<T>& v) {
  return scaled(v, gain.g);
}
template <class T>
inline Mat3<T> operator*(const Isotropic<T>& gain, const Mat3<T>& m) {
  return scaled(m, gain.g);
}
template <class T>
inline Mat3<T> operator*(const Sym3<T>& m, const Isotropic<T>& gain) {
  return scaled(math::full(m), gain.g);
}
template <class T>
inline Sym3<T>& operator+=(Sym3<T>& m, const Isotropic<T>& gain) {
  m.xx = m.xx + gain.g;
  m.yy = m.yy + gain.g;
  m.zz = m.zz + gain.g;
  return m;
}

/// Own inertia and momentum target of a body, without its children.
template <class T>
inline Articulated<T> own_inertia(const Constants<T>& body, const Node<T>& node) {
  Articulated<T> own;
  const T& m = body.mass;
  const T zero{};
  const Vec3<T> mc = scaled(node.c, m);
  own.A = math::point_inertia(m, node.c);
  own.A += math::dyad(T(1.0), node.u);
  own.A += math::dyad(T(1.0), node.v);
  own.A += Isotropic<T>{body.inertia};
  own.H = {zero, -mc.z, mc.y, mc.z, zero, -mc.x, -mc.y, mc.x, zero};
  own.M = {m, zero, zero, m, zero, m};
  own.b_linear = node.target_linear;
  own.b_angular = node.target_angular + cross(node.c, node.target_linear);
  return own;
}

/// What an implicit spring adds at the point r from the body's origin: a mass k = h (h K + D) with the impulse h times
/// its pull, and the same for rotation.
inline Articulated<double> spring_terms(const Vec3<double>& r, double k, const Vec3<double>& impulse, double angular_k,
                                        const Vec3<double>& angular_impulse) {
  const Vec3<double> kr = scaled(r, k);
  Articulated<double> terms{.A = math::point_inertia(k, r),
                            .H = {0.0, -kr.z, kr.y, kr.z, 0.0, -kr.x, -kr.y, kr.x, 0.0},
                            .M = {k, 0.0, 0.0, k, 0.0, k},
                            .b_angular = angular_impulse + cross(r, impulse),
                            .b_linear = impulse};
  terms.A += Sym3<double>{angular_k, 0.0, 0.0, angular_k, 0.0, angular_k};
  return terms;
}

/// Eliminates a ball joint of gain G (Sym3 or Isotropic) and residual r from `own`: fills the node's factor, returns
/// what its parent gets, seen from this joint.
template <class T, class Gain>
inline Articulated<T> eliminate(const Articulated<T>& own, const Gain& G, const Vec3<T>& residual, Node<T>& node) {
  Sym3<T> AG = own.A;
  AG += G;
  const Sym3<T> X = inverse(AG);
  node.P = X * G;
  node.B = X * own.H;
  node.y = X * (own.b_angular + residual);
  return {math::symmetric_product(own.A, node.P), G * node.B, own.M - math::symmetric_transposed_product(own.H, node.B),
          G * node.y - residual, own.b_linear - transposed_times(own.H, node.y)};
}

template <class Mask, class T>
inline Articulated<T> select(const Mask& mask, const Articulated<T>& yes, const Articulated<T>& no) {
  return {select(mask, yes.A, no.A), select(mask, yes.H, no.H), select(mask, yes.M, no.M),
          select(mask, yes.b_angular, no.b_angular), select(mask, yes.b_linear, no.b_linear)};
}

/// The same with G and r in the axes of the joint's section, and in the sectional lanes the node's factor too, for
/// parent angular velocities in section axes and linear ones in world axes. Torques go to the world by E = axes,
/// velocities by D = motion = E^-T. The gain of the other lanes is in world axes, and they are eliminated there, as if
/// they were alone.
template <class T>
inline Articulated<T> eliminate_in_section(const Articulated<T>& own, const Sym3<T>& G, const Vec3<T>& residual,
                                           Node<T>& node) {
  const Mat3<T>& E = node.axes;
  const Mat3<T> Dt = transposed(motion_of(node));
  const auto turned = [](const Mat3<T>& R, const Articulated<T>& a) -> Articulated<T> {
    return {congruent(R, a.A), R * a.H, a.M, R * a.b_angular, a.b_linear};
  };
  if (!node.mixed) return turned(E, eliminate(turned(Dt, own), G, residual, node));
  const auto sectional = node.sectional > T(0.0);
  const Articulated<T> up =
      eliminate(select(sectional, turned(Dt, own), own), G, math::select(sectional, residual, E * residual), node);
  return select(sectional, turned(E, up), up);
}

/// A reduced child seen from the parent's origin, which is -r away:
///     M_p = M',  H_p = H' + [r] M',  A_p = A' - (H' + [r] M') [r] + [r] H'^T,  b_a = b_a' + r x b_l'
template <class T>
inline Articulated<T> shifted(const Articulated<T>& child, const Vec3<T>& r) {
  const Sym3<T>& A = child.A;
  const Mat3<T>& H = child.H;
  const Sym3<T>& M = child.M;
  const Mat3<T> S{H.xx + (r.y * M.xz - r.z * M.xy), H.xy + (r.y * M.yz - r.z * M.yy), H.xz + (r.y * M.zz - r.z * M.yz),
                  H.yx + (r.z * M.xx - r.x * M.xz), H.yy + (r.z * M.xy - r.x * M.yz), H.yz + (r.z * M.xz - r.x * M.zz),
                  H.zx + (r.x * M.xy - r.y * M.xx), H.zy + (r.x * M.yy - r.y * M.xy), H.zz + (r.x * M.yz - r.y * M.xz)};
  // Row i of -S [r] is r x (row i of S); column j of [r] H'^T is r x (row j of H').
  return {Sym3<T>{A.xx + (r.y * S.xz - r.z * S.xy) + (r.y * H.xz - r.z * H.xy),
                  A.xy + (r.z * S.xx - r.x * S.xz) + (r.y * H.yz - r.z * H.yy),
                  A.xz + (r.x * S.xy - r.y * S.xx) + (r.y * H.zz - r.z * H.zy),
                  A.yy + (r.z * S.yx - r.x * S.yz) + (r.z * H.yx - r.x * H.yz),
                  A.yz + (r.x * S.yy - r.y * S.yx) + (r.z * H.zx - r.x * H.zz),
                  A.zz + (r.x * S.zy - r.y * S.zx) + (r.x * H.zy - r.y * H.zx)},
          S, M, child.b_angular + cross(r, child.b_linear), child.b_linear};
}

/// Velocity of a free root: [[A, H], [H^T, M]] [w; v] = [b_a; b_l].
template <class T>
inline void solve_free_root(const Articulated<T>& root, Vec3<T>& w_WB, Vec3<T>& v_WB) {
  const Sym3<T> Mi = inverse(root.M);
  const Mat3<T>& H = root.H;
  const Mat3<T> Ht{H.xx, H.yx, H.zx, H.xy, H.yy, H.zy, H.xz, H.yz, H.zz};
  // Schur complement A - H M^-1 H^T
  const Sym3<T> S = root.A - math::symmetric_transposed_product(Ht, Mi * Ht);
  w_WB = inverse(S) * (root.b_angular - H * (Mi * root.b_linear));
  v_WB = Mi * (root.b_linear - transposed_times(H, w_WB));
}

}  // namespace layfigure::dynamics
