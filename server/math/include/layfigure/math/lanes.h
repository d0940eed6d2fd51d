#pragma once

#include <cmath>

/// Scalars that may be a double or a pack of doubles, one per SIMD lane, so that one kernel serves a single run and
/// several runs side by side.
namespace layfigure::math {

/// Four truth values.
struct alignas(32) Mask4 {
  using Vector = long long __attribute__((vector_size(32)));
  Vector v;
};

/// Four doubles. The compiler's own vector type inside a struct: that alone has no alignment of its own where the
/// instruction set lacks 32-byte registers.
struct alignas(32) Lanes4 {
  using Vector = double __attribute__((vector_size(32)));

  Lanes4() = default;
  Lanes4(double scalar) : v(Vector{} + scalar) {}  // NOLINT: a scalar stands for itself in every lane
  explicit Lanes4(const Vector& vector) : v(vector) {}

  Vector v;
};

inline Lanes4 operator+(const Lanes4& a, const Lanes4& b) { return Lanes4(a.v + b.v); }
inline Lanes4 operator-(const Lanes4& a, const Lanes4& b) { return Lanes4(a.v - b.v); }
inline Lanes4 operator*(const Lanes4& a, const Lanes4& b) { return Lanes4(a.v * b.v); }
inline Lanes4 operator/(const Lanes4& a, const Lanes4& b) { return Lanes4(a.v / b.v); }
inline Lanes4 operator-(const Lanes4& a) { return Lanes4(-a.v); }
inline Mask4 operator<(const Lanes4& a, const Lanes4& b) { return {a.v < b.v}; }
inline Mask4 operator<=(const Lanes4& a, const Lanes4& b) { return {a.v <= b.v}; }
inline Mask4 operator>(const Lanes4& a, const Lanes4& b) { return {a.v > b.v}; }
inline Mask4 operator>=(const Lanes4& a, const Lanes4& b) { return {a.v >= b.v}; }
inline Mask4 operator==(const Lanes4& a, const Lanes4& b) { return {a.v == b.v}; }
inline Mask4 operator&&(const Mask4& a, const Mask4& b) { return {a.v & b.v}; }
inline Mask4 operator||(const Mask4& a, const Mask4& b) { return {a.v | b.v}; }
inline Mask4 operator!(const Mask4& a) { return {~a.v}; }

template <class T>
struct LaneTraits;
template <>
struct LaneTraits<double> {
  static constexpr int kCount = 1;
};
template <>
struct LaneTraits<Lanes4> {
  static constexpr int kCount = 4;
};

inline double lane(double value, int) { return value; }
inline double lane(const Lanes4& value, int index) { return value.v[index]; }
inline void set_lane(double& value, int, double scalar) { value = scalar; }
inline void set_lane(Lanes4& value, int index, double scalar) { value.v[index] = scalar; }

/// The pack of f(0), f(1), .. , one per lane. Built in a register: a pack that is written lane by lane to memory and
/// then read whole stalls the processor.
template <class T, class F>
inline T from_lanes(const F& f) {
  if constexpr (LaneTraits<T>::kCount == 1) {
    return f(0);
  } else {
    return T(typename T::Vector{f(0), f(1), f(2), f(3)});
  }
}

/// Four values, as four doubles side by side in memory have them.
template <class T>
struct Quad {
  T a, b, c, d;
};

/// Rows to columns.
inline Quad<Lanes4> transposed(const Quad<Lanes4>& m) {
  const auto ab_even = __builtin_shufflevector(m.a.v, m.b.v, 0, 4, 2, 6);
  const auto ab_odd = __builtin_shufflevector(m.a.v, m.b.v, 1, 5, 3, 7);
  const auto cd_even = __builtin_shufflevector(m.c.v, m.d.v, 0, 4, 2, 6);
  const auto cd_odd = __builtin_shufflevector(m.c.v, m.d.v, 1, 5, 3, 7);
  return {Lanes4(__builtin_shufflevector(ab_even, cd_even, 0, 1, 4, 5)),
          Lanes4(__builtin_shufflevector(ab_odd, cd_odd, 0, 1, 4, 5)),
          Lanes4(__builtin_shufflevector(ab_even, cd_even, 2, 3, 6, 7)),
          Lanes4(__builtin_shufflevector(ab_odd, cd_odd, 2, 3, 6, 7))};
}

inline const double* numbers(const Lanes4& value) { return reinterpret_cast<const double*>(&value.v); }

/// Four doubles from an address that is a multiple of 32.
inline Lanes4 load(const double* from) { return Lanes4(*reinterpret_cast<const Lanes4::Vector*>(from)); }
inline void store(const Lanes4& value, double* to) { *reinterpret_cast<Lanes4::Vector*>(to) = value.v; }

/// What is at address(0), address(1), .. , four doubles each, one per lane.
template <class T, class F>
inline Quad<T> gather(const F& address) {
  if constexpr (LaneTraits<T>::kCount == 1) {
    const double* const from = address(0);
    return {from[0], from[1], from[2], from[3]};
  } else {
    return transposed({load(address(0)), load(address(1)), load(address(2)), load(address(3))});
  }
}
/// Puts each lane's four doubles to its address.
template <class T, class F>
inline void scatter(const Quad<T>& value, const F& address) {
  if constexpr (LaneTraits<T>::kCount == 1) {
    double* const to = address(0);
    to[0] = value.a, to[1] = value.b, to[2] = value.c, to[3] = value.d;
  } else {
    const Quad<T> rows = transposed(value);
    store(rows.a, address(0)), store(rows.b, address(1)), store(rows.c, address(2)), store(rows.d, address(3));
  }
}

/// Sum over the lanes.
template <class T>
inline double total(const T& value) {
  double sum = lane(value, 0);
  for (int k = 1; k < LaneTraits<T>::kCount; ++k) sum += lane(value, k);
  return sum;
}

inline bool any(bool mask) { return mask; }
inline bool all(bool mask) { return mask; }
inline bool any(const Mask4& mask) { return (mask.v[0] | mask.v[1] | mask.v[2] | mask.v[3]) != 0; }
inline bool all(const Mask4& mask) { return (mask.v[0] & mask.v[1] & mask.v[2] & mask.v[3]) != 0; }

inline bool lane(bool mask, int) { return mask; }
inline bool lane(const Mask4& mask, int index) { return mask.v[index] != 0; }

inline double select(bool mask, double yes, double no) { return mask ? yes : no; }
inline Lanes4 select(const Mask4& mask, const Lanes4& yes, const Lanes4& no) { return Lanes4(mask.v ? yes.v : no.v); }

template <class T>
inline T maximum(const T& a, const T& b) {
  return select(a > b, a, b);
}

inline double square_root(double x) { return std::sqrt(x); }
inline Lanes4 square_root(const Lanes4& x) {
  return Lanes4(
      Lanes4::Vector{__builtin_sqrt(x.v[0]), __builtin_sqrt(x.v[1]), __builtin_sqrt(x.v[2]), __builtin_sqrt(x.v[3])});
}

}  // namespace layfigure::math
