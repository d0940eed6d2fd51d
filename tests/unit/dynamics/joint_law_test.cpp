#include "layfigure/dynamics/joint_law.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace layfigure::dynamics {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr FlowLaw kLaws[] = {FlowLaw::kPaper, FlowLaw::kOverstress};

double torque(FlowLaw law, double a, double flow_damping, double yield, double trial) {
  return trial * radial_return(law, a, flow_damping, yield, trial).tangential;
}

TEST(RadialReturn, BelowYield_IsElastic) {
  for (const FlowLaw law : kLaws) EXPECT_EQ(torque(law, 0.5, 0.2, 1.0, 0.99), 0.99);
}

TEST(RadialReturn, AboveYield_MeetsTheFlowLaw) {
  for (const double trial : {1.01, 1.5, 4.0, 100.0}) {
    for (const double a : {1e-3, 0.5, 20.0}) {
      for (const double d : {1e-3, 0.2, 10.0}) {
        const double paper = torque(FlowLaw::kPaper, a, d, 1.0, trial);
        const double paper_flow = (trial - paper) / a;
        if (paper > 1.0) {
          EXPECT_NEAR(paper_flow, paper / d, 1e-12 * (trial / a + trial / d));
        } else {
          EXPECT_EQ(paper, 1.0);
          EXPECT_LE(paper_flow, 1.0 / d * (1.0 + 1e-12));
        }
        const double over = torque(FlowLaw::kOverstress, a, d, 1.0, trial);
        EXPECT_NEAR((trial - over) / a, (over - 1.0) / d, 1e-11 * (trial / a + trial / d));
      }
    }
  }
}

TEST(RadialReturn, TrialTorque_RaisesTheTorqueMonotonically) {
  for (const FlowLaw law : kLaws) {
    double last = 0.0;
    for (double trial = 0.001; trial < 10.0; trial += 0.001) {
      const double now = torque(law, 0.3, 0.2, 1.0, trial);
      EXPECT_GE(now, last - 1e-15);
      EXPECT_LE(now - last, 0.001 + 1e-12) << "steeper than elastic, or a jump, at " << trial;
      last = now;
    }
  }
}

TEST(RadialReturn, Slope_IsTheCentralDifference) {
  constexpr double kStep = 1e-6;
  for (const FlowLaw law : kLaws) {
    for (const double trial : {0.5, 1.2, 3.0, 9.0}) {
      const double difference =
          (torque(law, 0.3, 0.2, 1.0, trial + kStep) - torque(law, 0.3, 0.2, 1.0, trial - kStep)) / (2.0 * kStep);
      EXPECT_NEAR(radial_return(law, 0.3, 0.2, 1.0, trial).radial, difference, 1e-8);
    }
  }
}

TEST(RadialReturn, Limits_ComeOutRight) {
  for (const FlowLaw law : kLaws) {
    EXPECT_EQ(torque(law, 0.3, 0.2, kInfinity, 1e12), 1e12) << "infinite yield torque: elastic";
    EXPECT_EQ(torque(law, 0.3, 0.0, 1.0, 50.0), 1.0) << "no flow damping: perfectly plastic";
    EXPECT_NEAR(torque(law, 0.3, 1e12, 1.0, 50.0), 50.0, 1e-9) << "infinite flow damping: elastic";
    EXPECT_NEAR(torque(law, 0.3, 0.2, 0.0, 2.0), 2.0 * 0.2 / 0.5, 1e-15) << "no yield torque: three-element creep";
    EXPECT_NEAR(torque(law, 1e12, 0.2, 1.0, 1e15), law == FlowLaw::kPaper ? 200.0 : 201.0, 1e-6)
        << "rigid until yield: the flow element alone";
    EXPECT_TRUE(std::isfinite(torque(law, 0.0, 0.0, 0.0, 0.0))) << "no law at all";
  }
}

}  // namespace
}  // namespace layfigure::dynamics
