// The energy of the hand-over between haptic ticks and physics.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "random_contacts.h"

namespace layfigure::haptics {
namespace {

// What the haptics are held to [J].
constexpr double kDeepestDip = 1e-3;

TEST(HandOver, RandomContacts_MakeNoEnergy) {
  for (const int hands : {1, 2}) {
    for (const double physics_hz : {100.0, 500.0}) {
      SCOPED_TRACE(std::to_string(hands) + " hands, physics at " + std::to_string(physics_hz) + " Hz");
      const testing::ContactEnergy found = testing::run_random_contacts(hands, 500, physics_hz, 1000.0);
      EXPECT_GE(found.contacts, 500);
      if (hands > 1) {
        EXPECT_GT(found.together, found.contacts / 10) << "both touch at once, too";
      }
      EXPECT_GE(found.taken_in, 0.0) << "the hands get out no more than they put in";
      EXPECT_GE(found.lowest_hand_over, -kDeepestDip);
      EXPECT_EQ(found.unsolved, 0);
      EXPECT_LE(found.overbooked, 0.0) << "no step lost less than was booked of it";
    }
  }
}

TEST(HandOver, WildHandOnSlowPhysics_IsPaidBack) {
  // Far more than the physics resolves: the doll sways at a fifth of its rate.
  const testing::ContactEnergy found = testing::shake_doll(10.0, 50.0, 5e-3, 20.0);
  EXPECT_GE(found.taken_in, 0.0);
  EXPECT_TRUE(std::isfinite(found.largest_force));
  EXPECT_LE(found.largest_force, 20.0);
  EXPECT_GT(found.booked, 0.0);
  EXPECT_LE(found.overbooked, 0.0) << "no step lost less than was booked of it";
}

}  // namespace
}  // namespace layfigure::haptics
