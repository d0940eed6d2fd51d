#include "unit.h"

#include <gtest/gtest.h>

namespace layfigure::character {
namespace {

TEST(ChooseUnit, SaneSize_KeepsTheUnit) {
  for (const double unit : {1.0, kInch, 0.01}) {
    for (const bool stated : {false, true}) {
      const UnitChoice choice = choose_unit(1.8, unit, stated);
      EXPECT_EQ(choice.metres_per_unit, unit);
      EXPECT_TRUE(choice.fits);
    }
  }
}

TEST(ChooseUnit, NoUnitStated_LargestUnitOfSaneSizeIsTaken) {
  EXPECT_EQ(choose_unit(10.5, 1.0, false).metres_per_unit, 0.01);
  EXPECT_EQ(choose_unit(180.0, 1.0, false).metres_per_unit, 0.01);
  EXPECT_EQ(choose_unit(1800.0, 1.0, false).metres_per_unit, 0.001);
  EXPECT_EQ(choose_unit(1.8 * kInch, kInch, false).metres_per_unit, 1.0);
  EXPECT_EQ(choose_unit(1800.0 * kInch, kInch, false).metres_per_unit, 0.001);
}

TEST(ChooseUnit, UnitStated_IsBelievedForDragonsAndBeetles) {
  for (const double size : {0.03, 0.05, 12.0, 100.0}) EXPECT_EQ(choose_unit(size, 1.0, true).metres_per_unit, 1.0);
  EXPECT_EQ(choose_unit(150.0, 1.0, true).metres_per_unit, 0.01);
  EXPECT_EQ(choose_unit(0.018, 0.01, true).metres_per_unit, 1.0);
}

TEST(ChooseUnit, NoUnitFits_StaysAndSaysSo) {
  for (const double size : {1e-4, 1e6}) {
    const UnitChoice choice = choose_unit(size, 1.0, false);
    EXPECT_EQ(choice.metres_per_unit, 1.0);
    EXPECT_FALSE(choice.fits);
  }
}

}  // namespace
}  // namespace layfigure::character
