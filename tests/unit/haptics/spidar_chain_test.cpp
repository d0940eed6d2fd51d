#include "spidar_chain.h"

#include <gtest/gtest.h>

namespace layfigure::testing {
namespace {

// Of the SPIDAR-G6X3's encoders [m].
constexpr double kCount = 16.66e-6;

TEST(IdealWall, LargestStiffness_IsThatOfTheReference) {
  // Reference figures to two digits; near its border stability comes and goes with how the wall is met.
  constexpr double kAgree = 0.08;
  const auto largest = [](double rate) {
    return largest_stiffness([rate](double k) { return ideal_wall_holds(k, rate, kCount); });
  };
  EXPECT_NEAR(largest(1000.0) / 2700.0, 1.0, kAgree);
  EXPECT_NEAR(largest(4000.0) / 5900.0, 1.0, kAgree);
  EXPECT_NEAR(largest(10'000.0) / 9400.0, 1.0, kAgree);
}

TEST(SpidarChain, StiffWall_HoldsAtFourFifthsOfTheIdealOne) {
  const spidar::Geometry geometry = spidar::load_geometry(LAYFIGURE_SPIDAR_FILES "/g6x3.toml");
  constexpr double kDamping = 1.0;
  EXPECT_TRUE(chain_wall_holds(geometry, {.rate_hz = 1000.0}, Press::kHand, 0.8 * 2700.0, kDamping));
  EXPECT_TRUE(chain_wall_holds(geometry, {.rate_hz = 4000.0}, Press::kHand, 0.8 * 5900.0, kDamping));
}

TEST(SpidarChain, WallFarTooStiff_Shakes) {
  const spidar::Geometry geometry = spidar::load_geometry(LAYFIGURE_SPIDAR_FILES "/g6x3.toml");
  EXPECT_FALSE(chain_wall_holds(geometry, {.rate_hz = 1000.0}, Press::kHand, 60'000.0, 0.0));
}

}  // namespace
}  // namespace layfigure::testing
