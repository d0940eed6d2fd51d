#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>

#include "layfigure/math/half_angle.h"
#include "layfigure/math/lanes.h"

/// Fixed-size vectors, matrices and quaternions for the solver's inner loops, generic in the scalar (double or lanes).
/// Symmetric matrices keep six numbers, so they cannot lose their symmetry to rounding.
namespace layfigure::math {

template <class T>
struct Vec3 {
  T x, y, z;
};

template <class T, class S>
inline Vec3<T> scaled(const Vec3<T>& a, const S& s) {
  return {a.x * s, a.y * s, a.z * s};
}
template <class T>
inline Vec3<T> operator+(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T>
inline Vec3<T> operator-(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class T>
inline Vec3<T>& operator+=(Vec3<T>& a, const Vec3<T>& b) {
  return a = a + b;
}
template <class T>
inline T dot(const Vec3<T>& a, const Vec3<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
inline Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T, class Mask>
inline Vec3<T> select(const Mask& mask, const Vec3<T>& yes, const Vec3<T>& no) {
  return {select(mask, yes.x, no.x), select(mask, yes.y, no.y), select(mask, yes.z, no.z)};
}

/// Rows m[row][column].
template <class T>
struct Mat3 {
  T xx, xy, xz, yx, yy, yz, zx, zy, zz;
};

template <class T>
inline Mat3<T> scaled(const Mat3<T>& m, const T& s) {
  return {m.xx * s, m.xy * s, m.xz * s, m.yx * s, m.yy * s, m.yz * s, m.zx * s, m.zy * s, m.zz * s};
}
template <class T>
inline Mat3<T>& operator+=(Mat3<T>& a, const Mat3<T>& b) {
  return a = {a.xx + b.xx, a.xy + b.xy, a.xz + b.xz, a.yx + b.yx, a.yy + b.yy,
              a.yz + b.yz, a.zx + b.zx, a.zy + b.zy, a.zz + b.zz};
}
template <class T>
inline Vec3<T> operator*(const Mat3<T>& m, const Vec3<T>& v) {
  return {m.xx * v.x + m.xy * v.y + m.xz * v.z, m.yx * v.x + m.yy * v.y + m.yz * v.z,
          m.zx * v.x + m.zy * v.y + m.zz * v.z};
}
/// transpose(m) v
template <class T>
inline Vec3<T> transposed_times(const Mat3<T>& m, const Vec3<T>& v) {
  return {m.xx * v.x + m.yx * v.y + m.zx * v.z, m.xy * v.x + m.yy * v.y + m.zy * v.z,
          m.xz * v.x + m.yz * v.y + m.zz * v.z};
}

template <class T>
inline Mat3<T> transposed(const Mat3<T>& m) {
  return {m.xx, m.yx, m.zx, m.xy, m.yy, m.zy, m.xz, m.yz, m.zz};
}
template <class T>
inline Mat3<T> operator*(const Mat3<T>& a, const Mat3<T>& b) {
  return {a.xx * b.xx + a.xy * b.yx + a.xz * b.zx, a.xx * b.xy + a.xy * b.yy + a.xz * b.zy,
          a.xx * b.xz + a.xy * b.yz + a.xz * b.zz, a.yx * b.xx + a.yy * b.yx + a.yz * b.zx,
          a.yx * b.xy + a.yy * b.yy + a.yz * b.zy, a.yx * b.xz + a.yy * b.yz + a.yz * b.zz,
          a.zx * b.xx + a.zy * b.yx + a.zz * b.zx, a.zx * b.xy + a.zy * b.yy + a.zz * b.zy,
          a.zx * b.xz + a.zy * b.yz + a.zz * b.zz};
}

template <class T>
struct Sym3 {
  T xx, xy, xz, yy, yz, zz;
};

template <class T>
inline Sym3<T>& operator+=(Sym3<T>& a, const Sym3<T>& b) {
  return a = {a.xx + b.xx, a.xy + b.xy, a.xz + b.xz, a.yy + b.yy, a.yz + b.yz, a.zz + b.zz};
}
template <class T>
inline Sym3<T> operator-(const Sym3<T>& a, const Sym3<T>& b) {
  return {a.xx - b.xx, a.xy - b.xy, a.xz - b.xz, a.yy - b.yy, a.yz - b.yz, a.zz - b.zz};
}
template <class Mask, class T>
inline Mat3<T> select(const Mask& mask, const Mat3<T>& yes, const Mat3<T>& no) {
  return {select(mask, yes.xx, no.xx), select(mask, yes.xy, no.xy), select(mask, yes.xz, no.xz),
          select(mask, yes.yx, no.yx), select(mask, yes.yy, no.yy), select(mask, yes.yz, no.yz),
          select(mask, yes.zx, no.zx), select(mask, yes.zy, no.zy), select(mask, yes.zz, no.zz)};
}
template <class Mask, class T>
inline Sym3<T> select(const Mask& mask, const Sym3<T>& yes, const Sym3<T>& no) {
  return {select(mask, yes.xx, no.xx), select(mask, yes.xy, no.xy), select(mask, yes.xz, no.xz),
          select(mask, yes.yy, no.yy), select(mask, yes.yz, no.yz), select(mask, yes.zz, no.zz)};
}
template <class T>
inline Mat3<T> full(const Sym3<T>& m) {
  return {m.xx, m.xy, m.xz, m.xy, m.yy, m.yz, m.xz, m.yz, m.zz};
}
template <class T>
inline Vec3<T> operator*(const Sym3<T>& m, const Vec3<T>& v) {
  return full(m) * v;
}
template <class T>
inline Mat3<T> operator*(const Sym3<T>& a, const Mat3<T>& b) {
  return full(a) * b;
}
template <class T>
inline Mat3<T> operator*(const Sym3<T>& a, const Sym3<T>& b) {
  return a * full(b);
}
/// The product of a symmetric and a general matrix, where the product is known to be symmetric.
template <class T>
inline Sym3<T> symmetric_product(const Sym3<T>& a, const Mat3<T>& b) {
  return {a.xx * b.xx + a.xy * b.yx + a.xz * b.zx, a.xx * b.xy + a.xy * b.yy + a.xz * b.zy,
          a.xx * b.xz + a.xy * b.yz + a.xz * b.zz, a.xy * b.xy + a.yy * b.yy + a.yz * b.zy,
          a.xy * b.xz + a.yy * b.yz + a.yz * b.zz, a.xz * b.xz + a.yz * b.yz + a.zz * b.zz};
}
/// transpose(a) b, where it is known to be symmetric.
template <class T>
inline Sym3<T> symmetric_transposed_product(const Mat3<T>& a, const Mat3<T>& b) {
  return {a.xx * b.xx + a.yx * b.yx + a.zx * b.zx, a.xx * b.xy + a.yx * b.yy + a.zx * b.zy,
          a.xx * b.xz + a.yx * b.yz + a.zx * b.zz, a.xy * b.xy + a.yy * b.yy + a.zy * b.zy,
          a.xy * b.xz + a.yy * b.yz + a.zy * b.zz, a.xz * b.xz + a.yz * b.yz + a.zz * b.zz};
}
/// E m E^T
template <class T>
inline Sym3<T> congruent(const Mat3<T>& E, const Sym3<T>& m) {
  const Mat3<T> Em = E * full(m);
  return {Em.xx * E.xx + Em.xy * E.xy + Em.xz * E.xz, Em.xx * E.yx + Em.xy * E.yy + Em.xz * E.yz,
          Em.xx * E.zx + Em.xy * E.zy + Em.xz * E.zz, Em.yx * E.yx + Em.yy * E.yy + Em.yz * E.yz,
          Em.yx * E.zx + Em.yy * E.zy + Em.yz * E.zz, Em.zx * E.zx + Em.zy * E.zy + Em.zz * E.zz};
}
/// E diag(d) E^T
template <class T>
inline Sym3<T> congruent(const Mat3<T>& E, const Vec3<T>& d) {
  const T xx = E.xx * d.x, xy = E.xy * d.y, xz = E.xz * d.z;
  const T yx = E.yx * d.x, yy = E.yy * d.y, yz = E.yz * d.z;
  const T zx = E.zx * d.x, zy = E.zy * d.y, zz = E.zz * d.z;
  return {xx * E.xx + xy * E.xy + xz * E.xz, xx * E.yx + xy * E.yy + xz * E.yz, xx * E.zx + xy * E.zy + xz * E.zz,
          yx * E.yx + yy * E.yy + yz * E.yz, yx * E.zx + yy * E.zy + yz * E.zz, zx * E.zx + zy * E.zy + zz * E.zz};
}
/// s n n^T
template <class T>
inline Sym3<T> dyad(const T& s, const Vec3<T>& n) {
  const Vec3<T> sn = scaled(n, s);
  return {sn.x * n.x, sn.x * n.y, sn.x * n.z, sn.y * n.y, sn.y * n.z, sn.z * n.z};
}
/// [r]^T [r] mass = mass (r^2 1 - r r^T): the inertia of a point mass at r.
template <class T, class S>
inline Sym3<T> point_inertia(const S& mass, const Vec3<T>& r) {
  const T mx = r.x * mass, my = r.y * mass, mz = r.z * mass;
  return {my * r.y + mz * r.z, -(mx * r.y), -(mx * r.z), mx * r.x + mz * r.z, -(my * r.z), mx * r.x + my * r.y};
}
/// Inverse of a symmetric positive definite matrix by its adjugate.
template <class T>
inline Sym3<T> inverse(const Sym3<T>& a) {
  const T cxx = a.yy * a.zz - a.yz * a.yz;
  const T cxy = a.xz * a.yz - a.xy * a.zz;
  const T cxz = a.xy * a.yz - a.xz * a.yy;
  const T d = 1.0 / (a.xx * cxx + a.xy * cxy + a.xz * cxz);
  return {cxx * d,
          cxy * d,
          cxz * d,
          (a.xx * a.zz - a.xz * a.xz) * d,
          (a.xy * a.xz - a.xx * a.yz) * d,
          (a.xx * a.yy - a.xy * a.xy) * d};
}

template <class T>
struct Quat {
  T w, x, y, z;
};

template <class T>
inline Quat<T> conjugate(const Quat<T>& q) {
  return {q.w, -q.x, -q.y, -q.z};
}
template <class T>
inline Quat<T> operator*(const Quat<T>& a, const Quat<T>& b) {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
template <class T, class Mask>
inline Quat<T> select(const Mask& mask, const Quat<T>& yes, const Quat<T>& no) {
  return {select(mask, yes.w, no.w), select(mask, yes.x, no.x), select(mask, yes.y, no.y), select(mask, yes.z, no.z)};
}
/// One Newton step towards unit length: exact to rounding for a product of unit quaternions.
template <class T>
inline Quat<T> renormalized(const Quat<T>& q) {
  const T s = 1.5 - 0.5 * (q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  return {q.w * s, q.x * s, q.y * s, q.z * s};
}
/// The vector turned by a unit quaternion, without its matrix.
template <class T>
inline Vec3<T> rotate(const Quat<T>& q, const Vec3<T>& v) {
  const Vec3<T> axis{q.x, q.y, q.z};
  const Vec3<T> t = cross(axis, v);
  const Vec3<T> t2 = t + t;
  return v + scaled(t2, q.w) + cross(axis, t2);
}
template <class T>
inline Mat3<T> matrix(const Quat<T>& q) {
  const T x2 = q.x + q.x, y2 = q.y + q.y, z2 = q.z + q.z;
  const T wx = q.w * x2, wy = q.w * y2, wz = q.w * z2;
  const T xx = q.x * x2, xy = q.x * y2, xz = q.x * z2;
  const T yy = q.y * y2, yz = q.y * z2, zz = q.z * z2;
  return {1.0 - (yy + zz), xy - wz, xz + wy, xy + wz, 1.0 - (xx + zz), yz - wx, xz - wy, yz + wx, 1.0 - (xx + yy)};
}

/// Rotation of |v| about v. Series up to 1 rad; the C library, lane by lane, beyond.
template <class T>
inline Quat<T> exp_rotation(const Vec3<T>& v) {
  const T x = 0.25 * dot(v, v);
  const auto small = x <= kSeriesLimit;
  T c = cos_sqrt(x);
  T s = 0.5 * sinc_sqrt(x);
  if (!all(small)) [[unlikely]] {
    for (int i = 0; i < LaneTraits<T>::kCount; ++i) {
      if (lane(small, i)) continue;
      const double half = std::sqrt(lane(x, i));
      set_lane(c, i, std::cos(half));
      set_lane(s, i, 0.5 * std::sin(half) / half);
    }
  }
  return {c, v.x * s, v.y * s, v.z * s};
}

/// Rotation vector of a unit quaternion, length in [0, pi]. Series up to 1 rad; the C library, lane by lane, beyond.
template <class T>
inline Vec3<T> log_rotation(const Quat<T>& q) {
  const T x = q.x * q.x + q.y * q.y + q.z * q.z;
  const auto small = x <= kSeriesLimit;
  T f = 2.0 * asinc_sqrt(x);
  if (!all(small)) [[unlikely]] {
    for (int i = 0; i < LaneTraits<T>::kCount; ++i) {
      if (lane(small, i)) continue;
      const double s = std::sqrt(lane(x, i));
      set_lane(f, i, 2.0 * std::atan2(s, std::abs(lane(q.w, i))) / s);
    }
  }
  f = select(q.w < 0.0, -f, f);
  return {q.x * f, q.y * f, q.z * f};
}

template <class T>
inline Vec3<T> broadcast(const Eigen::Vector3d& v) {
  return {T(v.x()), T(v.y()), T(v.z())};
}
template <class T>
inline Quat<T> broadcast(const Eigen::Quaterniond& q) {
  return {T(q.w()), T(q.x()), T(q.y()), T(q.z())};
}
template <class T>
inline Eigen::Vector3d lane(const Vec3<T>& v, int i) {
  return {lane(v.x, i), lane(v.y, i), lane(v.z, i)};
}
template <class T>
inline Eigen::Quaterniond lane(const Quat<T>& q, int i) {
  return {lane(q.w, i), lane(q.x, i), lane(q.y, i), lane(q.z, i)};
}
template <class T>
inline Vec3<double> lane_of(const Vec3<T>& v, int i) {
  return {lane(v.x, i), lane(v.y, i), lane(v.z, i)};
}
template <class T>
inline Quat<double> lane_of(const Quat<T>& q, int i) {
  return {lane(q.w, i), lane(q.x, i), lane(q.y, i), lane(q.z, i)};
}
template <class T>
inline Mat3<double> lane_of(const Mat3<T>& m, int i) {
  return {lane(m.xx, i), lane(m.xy, i), lane(m.xz, i), lane(m.yx, i), lane(m.yy, i),
          lane(m.yz, i), lane(m.zx, i), lane(m.zy, i), lane(m.zz, i)};
}
template <class T>
inline void set_lane(Vec3<T>& v, int i, const Eigen::Vector3d& value) {
  set_lane(v.x, i, value.x());
  set_lane(v.y, i, value.y());
  set_lane(v.z, i, value.z());
}
template <class T>
inline void set_lane(Quat<T>& q, int i, const Eigen::Quaterniond& value) {
  set_lane(q.w, i, value.w());
  set_lane(q.x, i, value.x());
  set_lane(q.y, i, value.y());
  set_lane(q.z, i, value.z());
}

}  // namespace layfigure::math
