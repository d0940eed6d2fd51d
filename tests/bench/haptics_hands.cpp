// The hands' rows: pinches, and two hands that play.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "haptics.h"
#include "pinch.h"
#include "pinched_doll.h"
#include "random_play.h"

namespace layfigure::bench {
namespace {

constexpr double kPinchDrift = 0.1;  // [mm]
constexpr int kCircles = 10;
constexpr double kTilt = 0.35;        // [rad]
constexpr double kTiltDrift = 1.0;    // [mm]
constexpr double kTiltTurn = 3.0;     // [deg]
constexpr double kSlip = 2.0;         // [%]
constexpr double kDeepestDip = 1e-3;  // [J]
constexpr double kLimit = 1.0 + 1e-9;
constexpr double kPhysicsRate = 250.0;
constexpr int kTicks = 8;

std::string seconds(double duration) { return std::to_string(std::lround(duration)) + " s"; }

}  // namespace

void tell_pinch(const HapticsEffort& effort, std::vector<Figure>& figures) {
  struct Case {
    const char* name;
    double off_center;  ///< [m]
    double tremor;      ///< [m]
  };
  constexpr Case kCases[] = {
      {"still hands", 0.0, 0.0}, {"trembling hands", 0.0, 3e-4}, {"trembling hands, by torsion too", 0.005, 1e-4}};
  for (const auto& [name, off_center, tremor] : kCases) {
    const double drift = haptics::pinch_drift(effort.pinch, off_center, tremor);
    figures.push_back(
        {"pinch hold for " + seconds(effort.pinch) + ", " + name + ": drift", 1e3 * drift, "mm", kPinchDrift});
  }
  for (const auto how : {haptics::Tilting::kInPlace, haptics::Tilting::kAboutTheMiddle}) {
    const haptics::TiltDrift drift = haptics::drift_by_tilting(how, kCircles, kTilt);
    const std::string name = "pinch, " + std::to_string(kCircles) + " circles of hands that tilt by 20 degrees" +
                             (how == haptics::Tilting::kInPlace ? " in place: " : " with the limb: ");
    figures.push_back({name + "drift", 1e3 * drift.way, "mm", kTiltDrift});
    figures.push_back({name + "turn of the limb", drift.turn * 180.0 / std::numbers::pi, "deg", kTiltTurn});
  }
  double off = 0.0;
  for (const double friction : {0.5, 1.0, 2.0}) {
    const double expected = haptics::slip_pressure(friction);
    off = std::max(off, std::abs(haptics::pressure_at_slip(friction) / expected - 1.0));
  }
  figures.push_back({"pinch: slip threshold off the cone, most", 100.0 * off, "%", kSlip});
}

void tell_play(const HapticsEffort& effort, std::vector<Figure>& figures) {
  const testing::Play play = testing::play_at_random(testing::thick_doll(), effort.play, kPhysicsRate, kTicks);
  const std::string name = "two hands at random, for " + seconds(play.together) + " both on the doll: ";
  figures.push_back({name + "force / limit, most", play.force, "", kLimit});
  figures.push_back({name + "torque / limit, most", play.torque, "", kLimit});
  figures.push_back({name + "rise of force / limit, most", play.rise, "", kLimit});
  figures.push_back({name + "steps that failed or poses not finite", static_cast<double>(play.failures), "", 0.0});
  figures.push_back({name + "deepest dip of the hand-over", -play.lowest_hand_over, "J", kDeepestDip});
  figures.push_back({name + "contacts", static_cast<double>(play.contacts), ""});
  figures.push_back({name + "grabs", static_cast<double>(play.grabs), ""});
  figures.push_back({name + "all of it", play.duration, "s"});
}

}  // namespace layfigure::bench
