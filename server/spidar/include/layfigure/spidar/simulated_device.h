#pragma once

#include <Eigen/Core>
#include <optional>

#include "layfigure/spidar/geometry.h"

namespace layfigure::spidar {

/// A hand that holds the grip and wants to be somewhere: a mass on a spring and damper to where it wants to be (the
/// arm), which holds the grip by another (the skin). The same for turns, with the moments that the radius makes of the
/// masses, springs and dampers. The values are those fitted to people's hands in the literature.
struct HandModel {
  double mass{0.554};            ///< [kg]
  double arm_stiffness{135.0};   ///< [N/m]
  double arm_damping{6.45};      ///< [N s/m]
  double grip_stiffness{700.0};  ///< [N/m]
  double grip_damping{5.0};      ///< [N s/m]
  double radius{0.03};           ///< [m]
};

/// What the simulated device is made of.
struct SimulatedParts {
  HandModel hand;
  double grip_mass{0.05};   ///< [kg]
  double motor_lag{5e-4};   ///< time constant of the tensions [s]
  double friction{0.05};    ///< of a pulley: more on a string that is pulled out, less on one that is taken in [N]
  double reel_speed{10.0};  ///< at which a motor takes in a slack string [m/s]
};

/// What is wrong with it.
struct SimulatedFaults {
  std::optional<int> broken_string;  ///< pulls no more, and its end is reeled in
  std::optional<int> dead_motor;     ///< pulls no more and takes nothing in: its string sags when the grip comes nearer
  std::optional<int> stuck_encoder;  ///< tells the same length for ever
  bool frozen{false};                ///< all encoders tell the same lengths for ever: a driver that repeats itself
  bool silent{false};                ///< nothing can be read, and tensions do not arrive: lost messages, no power
  Lengths errors{Lengths::Zero()};   ///< more than what the encoders count [m], NaN too: counts that were missed, a
                                     ///< string that slipped on its reel, another device's zero
};

/// A SPIDAR whose every part is computed: the hand, the grip as a rigid body, strings that sag when they are taken in
/// too slowly, motors that lag, pulleys with friction, encoders that round and tell what was a tick ago.
///
/// Not thread-safe. Allocates nothing.
class SimulatedSpidar {
 public:
  /// The grip begins at rest in the centre. Throws GeometryError for parts that are not positive.
  explicit SimulatedSpidar(Geometry geometry, const SimulatedParts& parts = {});

  [[nodiscard]] const Geometry& geometry() const { return geometry_; }
  SimulatedFaults& faults() { return faults_; }

  /// What the motors are to pull with from now on; clamped to what they can. Values that are not finite count as the
  /// least.
  void command(const Tensions& tensions);

  /// Lets h > 0 seconds pass in which the hand wants to get to `wanted`, in steps of 50 us or less: implicit in the
  /// hand's springs, so stable at any h.
  void advance(double h, const Pose& wanted);

  /// The strings' lengths at the beginning of the last advance(), to a count; nothing if the device is silent.
  [[nodiscard]] std::optional<Lengths> read() const;

  /// The truth.
  [[nodiscard]] const Pose& grip() const { return grip_.pose; }
  [[nodiscard]] const Tensions& pulls() const { return pulls_; }
  /// Force on the hand by the skin [N] and the torque about the grip [N m].
  [[nodiscard]] const Wrench& felt() const { return felt_; }

 private:
  struct Body {
    Pose pose;
    Eigen::Vector3d velocity{Eigen::Vector3d::Zero()};
    Eigen::Vector3d spin{Eigen::Vector3d::Zero()};
  };

  void step(double h, const Pose& wanted);
  void pull(double h);
  void reel(double h);
  void move(double h, const Pose& wanted, const Wrench& wrench);
  void measure();

  Geometry geometry_;
  SimulatedParts parts_;
  SimulatedFaults faults_;
  Body hand_;
  Body grip_;
  Tensions commanded_;
  Tensions motors_;                 ///< after the lag
  Tensions pulls_;                  ///< on the grip
  Lengths paid_out_;                ///< between pulley and knot, longer than the way between them if slack
  Lengths way_;                     ///< between pulley and knot ...
  Lengths rates_{Lengths::Zero()};  ///< ... and how fast it grows [m/s]
  Lengths counted_;                 ///< now ...
  Lengths told_;                    ///< ... and a tick ago
  Wrench felt_{Wrench::Zero()};
};

}  // namespace layfigure::spidar
