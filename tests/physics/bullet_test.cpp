// The same scenes in Bullet's btMultiBody: an independent engine in single precision, so agreement is to a millimetre.
#include <gtest/gtest.h>

#include "bullet_world.h"
#include "scene.h"

namespace layfigure::testing {
namespace {

constexpr double kTolerance = 2e-3;        // m; Bullet's explicit step at 0.1 ms in single precision
constexpr double kEnergyTolerance = 2e-3;  // J, of some 0.1 J that move

void expect_agreement(const Scene& scene) {
  const dynamics::Model model(scene.definition);
  const BulletResult theirs = run_bullet(scene, static_cast<int>(std::lround(scene.duration / 1e-4)));
  const RunResult ours = run_scene(scene, model, 500, 4);
  const auto start = run_scene(scene, model, 0, 4).coms;
  ASSERT_TRUE(theirs.finite);
  for (std::size_t i = 0; i < ours.coms.size(); ++i) {
    EXPECT_LT((ours.coms[i] - theirs.coms[i]).norm(), kTolerance) << "link " << i;
    EXPECT_GT((ours.coms[i] - start[i]).norm(), 2.0 * kTolerance) << "it must have moved";
  }
  const double energy = dynamics::energy(model, ours.state).total();
  EXPECT_NEAR(theirs.energy, energy, kEnergyTolerance);
}

TEST(Bullet, LooseChainFalling_AgreesWithBtMultiBody) {
  Scene scene = chain({.links = 4, .stiffness = 0.0, .damping = 0.0});
  scene.definition.gravity = {0.0, 2.0, -9.0};
  scene.duration = 0.25;
  expect_agreement(scene);
}

TEST(Bullet, BentChainWithSpringsAndDampers_AgreesWithBtMultiBody) {
  Scene scene = chain({.links = 6, .bend = 0.3});
  scene.definition.gravity = {0.0, 0.0, -9.81};
  scene.duration = 0.25;
  expect_agreement(scene);
}

TEST(Bullet, SceneThatItCannotModel_IsRefused) {
  EXPECT_THROW(BulletWorld(pulled_chain({.links = 3})), std::runtime_error);
  EXPECT_THROW(BulletWorld(chain({.links = 3, .yield_torque = 0.1})), std::runtime_error);
}

}  // namespace
}  // namespace layfigure::testing
