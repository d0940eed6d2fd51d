#include "layfigure/math/lanes.h"

#include <gtest/gtest.h>

#include <random>

#include "layfigure/math/spatial.h"

namespace layfigure::math {
namespace {

template <class T>
Vec3<T> some_arithmetic(const Vec3<T>& a, const Vec3<T>& b) {
  const Quat<T> q = renormalized(exp_rotation(a) * exp_rotation(b));
  Sym3<T> inertia = point_inertia(T(2.0), a);
  inertia += dyad(T(1.5), b);
  inertia += Sym3<T>{T(0.3), T(0.0), T(0.0), T(0.3), T(0.0), T(0.3)};
  return inverse(inertia) * log_rotation(q) + rotate(q, cross(a, b));
}

TEST(Lanes4, EveryLane_AgreesWithTheScalar) {
  std::mt19937 random(7);
  // Some of the vectors leave the range of the series.
  std::uniform_real_distribution<double> uniform(-1.5, 1.5);
  for (int trial = 0; trial < 200; ++trial) {
    Vec3<Lanes4> a, b;
    for (int k = 0; k < 4; ++k) {
      const double scale = trial % 4 == k ? 1.0 : 0.2;
      set_lane(a, k, scale * Eigen::Vector3d(uniform(random), uniform(random), uniform(random)));
      set_lane(b, k, scale * Eigen::Vector3d(uniform(random), uniform(random), uniform(random)));
    }
    const Vec3<Lanes4> packed = some_arithmetic(a, b);
    for (int k = 0; k < 4; ++k) {
      const Vec3<double> single = some_arithmetic(lane_of(a, k), lane_of(b, k));
      // Beside a lane that leaves the series, its neighbours use the C library too: equal to rounding only.
      EXPECT_LT((lane(packed, k) - lane(single, 0)).norm(), 1e-13 * (1.0 + lane(single, 0).norm()));
    }
  }
}

TEST(Lanes4, Select_TakesLaneByLane) {
  Lanes4 a;
  for (int k = 0; k < 4; ++k) set_lane(a, k, k);
  const Lanes4 chosen = select(a > Lanes4(1.5), Lanes4(10.0), a);
  EXPECT_EQ(lane(chosen, 0), 0.0);
  EXPECT_EQ(lane(chosen, 1), 1.0);
  EXPECT_EQ(lane(chosen, 2), 10.0);
  EXPECT_EQ(lane(chosen, 3), 10.0);
  EXPECT_TRUE(any(a > Lanes4(2.5)));
  EXPECT_FALSE(all(a > Lanes4(2.5)));
}

TEST(Lanes4, GatherAndScatter_MoveFourNumbersOfEachLane) {
  alignas(32) double from[4][4];
  for (int k = 0; k < 4; ++k) {
    for (int j = 0; j < 4; ++j) from[k][j] = 10.0 * k + j;
  }
  const Quad<Lanes4> numbers = gather<Lanes4>([&](int k) { return from[3 - k]; });
  for (int k = 0; k < 4; ++k) {
    EXPECT_EQ(lane(numbers.a, k), from[3 - k][0]);
    EXPECT_EQ(lane(numbers.d, k), from[3 - k][3]);
  }
  alignas(32) double to[4][4];
  scatter(numbers, [&](int k) { return to[3 - k]; });
  for (int k = 0; k < 4; ++k) {
    for (int j = 0; j < 4; ++j) EXPECT_EQ(to[k][j], from[k][j]);
  }
}

TEST(Sym3, Inverse_OfStiffMatrix_KeepsItsDigits) {
  const Sym3<double> matrix{2e6, 3.0, -1.0, 4.0, 0.5, 5.0};
  const Sym3<double> inv = inverse(matrix);
  const Vec3<double> x{1e-6, 2.0, 3.0};
  const Vec3<double> back = inv * (matrix * x);
  EXPECT_NEAR(back.x, x.x, 1e-15);
  EXPECT_NEAR(back.y, x.y, 1e-14);
  EXPECT_NEAR(back.z, x.z, 1e-14);
}

}  // namespace
}  // namespace layfigure::math
