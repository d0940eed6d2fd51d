#pragma once

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "commands_fixture.h"
#include "layfigure/math/rotation.h"

namespace layfigure::app {

inline constexpr int kSpine = 1;
inline constexpr int kArm = 2;
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

class EditCommands : public Commands {
 protected:
  void steps(int count) { ASSERT_TRUE(send("step", {number_argument("count", {double(count)})}).accepted); }

  /// One gesture: lifts the arm so far that it flows [m], lets go, and lets it come to rest.
  void lift(double height) {
    const reply_t held = send("grab", {text_argument("bone", "arm")});
    ASSERT_TRUE(held.accepted) << held.reason;
    const std::vector<double> at = result(held, "position");
    point(++pointed_, {at[0], at[1], at[2] + height});
    steps(500);
    ASSERT_TRUE(send("release").accepted);
    steps(2000);
  }

  [[nodiscard]] double strain(int body) const {
    const dynamics::BodyState& now = simulation_.state().bodies[body];
    return math::log_rotation(now.rest_rotation.conjugate() * now.rotation).norm();
  }
  [[nodiscard]] const dynamics::JointLaw& law(int body) const {
    return simulation_.doll().definition.bodies[body].joint;
  }

  std::int64_t pointed_{0};
};

inline std::string text(const reply_t& reply, const std::string& name) {
  for (const argument_t& value : reply.results) {
    if (value.name == name) return value.text;
  }
  return {};
}

}  // namespace layfigure::app
