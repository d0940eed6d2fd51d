#pragma once

#include <cstring>
#include <string>

#include "layfigure/dynamics/state.h"

namespace layfigure::testing {

/// The first number, with its body, whose bits differ between two states; empty if none do. Zeros of different signs
/// differ.
[[nodiscard]] inline std::string first_difference(const dynamics::State& a, const dynamics::State& b) {
  if (std::memcmp(&a.time, &b.time, sizeof a.time) != 0) return "time";
  if (a.bodies.size() != b.bodies.size()) return "number of bodies";
  for (std::size_t i = 0; i < a.bodies.size(); ++i) {
    const dynamics::BodyState& x = a.bodies[i];
    const dynamics::BodyState& y = b.bodies[i];
    std::string name;
    const auto compare = [&](const char* what, const auto& p, const auto& q) {
      if (name.empty() && std::memcmp(&p, &q, sizeof p) != 0)
        name = std::string(what) + " of body " + std::to_string(i);
    };
    compare("rotation", x.rotation, y.rotation);
    compare("rest rotation", x.rest_rotation, y.rest_rotation);
    compare("linear momentum", x.linear_momentum, y.linear_momentum);
    compare("flow", x.flow, y.flow);
    compare("angular momentum", x.angular_momentum, y.angular_momentum);
    compare("yield scale", x.yield_scale, y.yield_scale);
    compare("trial torque", x.trial_torque, y.trial_torque);
    compare("limit slack", x.limit_slack, y.limit_slack);
    compare("torque", x.torque, y.torque);
    compare("rest time", x.rest_time, y.rest_time);
    compare("position", x.position, y.position);
    compare("yielding", x.yielding, y.yielding);
    compare("asleep", x.asleep, y.asleep);
    if (!name.empty()) return name;
  }
  return "";
}

}  // namespace layfigure::testing
