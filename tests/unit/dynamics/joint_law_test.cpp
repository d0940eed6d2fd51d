#include "layfigure/dynamics/joint_law.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace layfigure::dynamics {
namespace {

using math::Vec3;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr FlowLaw kLaws[] = {FlowLaw::kPaper, FlowLaw::kOverstress};

// --- along one axis --------------------------------------------------------------------------------------------------

StepLaw<double> isotropic(double a, double flow_damping, double yield, double hardening = 0.0) {
  return {.gain = {a, a, a},
          .inverse_shape = {1.0, 1.0, 1.0},
          .flow_damping = flow_damping,
          .hardening = hardening,
          .yield = yield};
}

double torque(FlowLaw kind, const StepLaw<double>& law, double trial) {
  return trial * radial_return(kind, law, Vec3<double>{trial, 0.0, 0.0}).share.x;
}

TEST(RadialReturn, BelowYield_IsElastic) {
  for (const FlowLaw kind : kLaws) EXPECT_EQ(torque(kind, isotropic(0.5, 0.2, 1.0), 0.99), 0.99);
}

TEST(RadialReturn, AboveYield_MeetsTheClosedForm) {
  for (const double trial : {1.01, 1.5, 4.0, 100.0}) {
    for (const double a : {1e-3, 0.5, 20.0}) {
      for (const double d : {1e-3, 0.2, 10.0}) {
        const double paper = std::max(1.0, trial * d / (d + a));
        EXPECT_NEAR(torque(FlowLaw::kPaper, isotropic(a, d, 1.0), trial), paper, 1e-13 * trial);
        const double overstress = (trial * d + a) / (d + a);
        EXPECT_NEAR(torque(FlowLaw::kOverstress, isotropic(a, d, 1.0), trial), overstress, 1e-13 * trial);
      }
    }
  }
}

TEST(RadialReturn, TrialTorque_RaisesTheTorqueMonotonically) {
  for (const FlowLaw kind : kLaws) {
    for (const double hardening : {0.0, 0.05}) {
      double last = 0.0;
      for (double trial = 0.001; trial < 10.0; trial += 0.001) {
        const double now = torque(kind, isotropic(0.3, 0.2, 1.0, hardening), trial);
        EXPECT_GE(now, last - 1e-14);
        EXPECT_LE(now - last, 0.001 + 1e-12) << "steeper than elastic, or a jump, at " << trial;
        last = now;
      }
    }
  }
}

TEST(RadialReturn, Limits_ComeOutRight) {
  for (const FlowLaw kind : kLaws) {
    EXPECT_EQ(torque(kind, isotropic(0.3, 0.2, kInfinity), 1e12), 1e12) << "infinite yield torque: elastic";
    EXPECT_NEAR(torque(kind, isotropic(0.3, 0.0, 1.0), 50.0), 1.0, 1e-14) << "no flow damping: perfectly plastic";
    EXPECT_NEAR(torque(kind, isotropic(0.3, 1e12, 1.0), 50.0), 50.0, 1e-9) << "infinite flow damping: elastic";
    EXPECT_NEAR(torque(kind, isotropic(0.3, 0.2, 0.0), 2.0), 2.0 * 0.2 / 0.5, 1e-15)
        << "no yield torque: three-element creep";
    EXPECT_NEAR(torque(kind, isotropic(1e12, 0.2, 1.0), 1e15), kind == FlowLaw::kPaper ? 200.0 : 201.0, 1e-6)
        << "rigid until yield: the flow element alone";
    EXPECT_EQ(torque(kind, isotropic(0.0, 0.0, 0.0), 0.0), 0.0) << "no law at all";
    EXPECT_LT(torque(kind, isotropic(0.3, 0.0, 0.0), 5.0), 1e-200) << "nothing resists";
  }
}

TEST(RadialReturn, Hardening_RaisesTheYieldByTheFlowOfTheStep) {
  // Perfectly plastic with hardening over one step: t = y + H h w_d, w_d = (s - t) / a.
  for (const FlowLaw kind : kLaws) {
    const double t = torque(kind, isotropic(0.3, 0.0, 1.0, 0.2), 5.0);
    EXPECT_NEAR(t, 1.0 + 0.2 * (5.0 - t) / 0.3, 1e-13);
  }
}

// --- in three dimensions ---------------------------------------------------------------------------------------------

struct Case {
  StepLaw<double> law;
  Vec3<double> trial;
};

Case random_case(std::mt19937& random) {
  std::uniform_real_distribution<double> exponent(-3.0, 3.0);
  const auto positive = [&] { return std::pow(10.0, exponent(random)); };
  const auto ratio = [&] { return std::pow(10.0, 0.3 * exponent(random)); };
  Case c{.law = {.gain = {positive(), positive(), positive()},
                 .inverse_shape = {ratio(), ratio(), ratio()},
                 .flow_damping = random() % 4 == 0 ? 0.0 : positive(),
                 .hardening = random() % 2 == 0 ? 0.0 : positive(),
                 .yield = random() % 5 == 0 ? 0.0 : positive()},
         .trial = {positive() - positive(), positive() - positive(), positive() - positive()}};
  if (random() % 6 == 0) c.law.inverse_shape.y = 0.0;  // an axis that never yields
  return c;
}

TEST(RadialReturn, RandomAnisotropicLaws_FlowNormallyAtTheLawsSpeed) {
  std::mt19937 random(11);
  int flowing = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const auto [law, s] = random_case(random);
    for (const FlowLaw kind : kLaws) {
      const auto ret = radial_return(kind, law, s);
      const Vec3<double> t = times(ret.share, s);
      const double n = std::sqrt(squared_norm(law, t));
      const double scale = std::sqrt(squared_norm(law, s)) + law.yield;
      if (ret.flowing == 0.0) {
        EXPECT_LE(n, law.yield * (1.0 + 1e-12));
        continue;
      }
      // mu from the axis that flows most: w_d = (s - t) / a = mu t / e^2
      double mu = 0.0;
      const Vec3<double> alpha = times(law.gain, law.inverse_shape);
      for (const double Vec3<double>::*axis : {&Vec3<double>::x, &Vec3<double>::y, &Vec3<double>::z}) {
        if (alpha.*axis > 0.0) mu = std::max(mu, (1.0 / (ret.share.*axis) - 1.0) / (alpha.*axis));
      }
      if (law.flow_damping == 0.0 && law.hardening == 0.0 && law.yield == 0.0) continue;  // no torque: mu is infinite
      ++flowing;
      const double speed = mu * n;
      const double grown = law.yield + law.hardening * speed;
      if (kind == FlowLaw::kOverstress) {
        EXPECT_NEAR(n, grown + law.flow_damping * speed, 1e-9 * scale);
      } else if (n > grown + 1e-9 * scale) {
        EXPECT_NEAR(speed * law.flow_damping, n, 1e-9 * scale) << "above the yield torque the damper alone";
      } else {
        EXPECT_NEAR(n, grown, 1e-9 * scale);
        EXPECT_LE(speed * law.flow_damping, n * (1.0 + 1e-9));
      }
    }
  }
  EXPECT_GT(flowing, 10000);
}

TEST(RadialReturn, Slope_IsTheCentralDifferenceAndSymmetric) {
  std::mt19937 random(12);
  for (int trial = 0; trial < 2000; ++trial) {
    const auto [law, s] = random_case(random);
    for (const FlowLaw kind : kLaws) {
      const auto ret = radial_return(kind, law, s);
      const double size = std::sqrt(dot(s, s));
      const double step = 1e-7 * size;
      const auto column = [&](Vec3<double> d) {
        const auto plus = radial_return(kind, law, s + scaled(d, step));
        const auto minus = radial_return(kind, law, s - scaled(d, step));
        // Across the border of two regimes there is no slope.
        if (plus.flowing != minus.flowing || (plus.curvature == 0.0) != (minus.curvature == 0.0)) return false;
        const Vec3<double> difference =
            scaled(times(plus.share, s + scaled(d, step)) - times(minus.share, s - scaled(d, step)), 0.5 / step);
        const Vec3<double> slope = times(ret.share, d) - scaled(times(law.gain, ret.u), ret.curvature * dot(ret.u, d));
        const Vec3<double> error = difference - slope;
        EXPECT_LT(std::sqrt(dot(error, error)), 1e-4) << "trial " << trial;
        return true;
      };
      column({1.0, 0.0, 0.0});
      column({0.0, 1.0, 0.0});
      column({0.0, 0.0, 1.0});
      EXPECT_GE(ret.curvature, 0.0);
    }
  }
}

}  // namespace
}  // namespace layfigure::dynamics
