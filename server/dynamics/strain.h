#pragma once

#include "layfigure/math/spatial.h"

/// How the rotation vector q of a joint's strain changes: with w the angular velocity in the child's axes,
///     q' = B w,   w = J q',   J = 1 - (1 - cos a) / a^2 [q] + (a - sin a) / a^3 [q]^2,   a = |q|
///     B = J^-1 = 1 + [q] / 2 + (1 - (a / 2) cot(a / 2)) / a^2 [q]^2
/// J is the right Jacobian of the exponential (Chirikjian, Stochastic Models, Information Theory, and Lie Groups, vol.
/// 2, 10.86). The spring energy q^T K q / 2 of a joint whose stiffness differs between the axes gives the torque
/// B^T K q, which only for an isotropic one is K q.
namespace layfigure::dynamics {

template <class T>
struct StrainRate {
  math::Mat3<T> J;
  math::Mat3<T> B_transposed;
};

/// 1 + y [q] + z [q]^2
template <class T>
inline math::Mat3<T> rotation_polynomial(const T& y, const T& z, const math::Vec3<T>& q) {
  const math::Vec3<T> yq = scaled(q, y);
  const T off = -z * dot(q, q);
  math::Mat3<T> sum = full(math::dyad(z, q));
  sum += math::Mat3<T>{T(1.0) + off, -yq.z, yq.y, yq.z, T(1.0) + off, -yq.x, -yq.y, yq.x, T(1.0) + off};
  return sum;
}

/// Of the strain q = rotvec(rotation). Where a is small the quotients lose digits, but [q]^2 makes that good.
template <class T>
inline StrainRate<T> strain_rate(const math::Quat<T>& rotation, const math::Vec3<T>& q) {
  const T square = dot(q, q);
  const auto turned = square > T(1e-30);
  const T a2 = math::select(turned, square, T(1.0));
  const T sine2 = rotation.x * rotation.x + rotation.y * rotation.y + rotation.z * rotation.z;
  const T cosine = math::select(rotation.w < T(0.0), -rotation.w, rotation.w);
  // sin(a / 2) / (a / 2)
  const T sinc = math::select(turned, T(2.0) * math::square_root(sine2 / a2), T(1.0));
  const T J2 = math::select(turned, (T(1.0) - sinc * cosine) / a2, T(0.0));
  const T B2 = math::select(turned, (T(1.0) - cosine / sinc) / a2, T(0.0));
  return {rotation_polynomial(T(-0.5) * sinc * sinc, J2, q), rotation_polynomial(T(-0.5), B2, q)};
}

}  // namespace layfigure::dynamics
