#pragma once

#include <functional>
#include <optional>

#include "layfigure/haptics/local_dynamics.h"
#include "layfigure/spidar/pose_solver.h"
#include "layfigure/spidar/simulated_device.h"
#include "layfigure/spidar/tension_solver.h"

/// The whole way from a hand to what is rendered and back: simulated SPIDAR, pose from its encoders, velocity, wrench,
/// tensions; and the ideal wall that its stiffness is measured by.
namespace layfigure::testing {

/// Velocity of the grip from its poses: differences, low-passed.
class VelocityFilter {
 public:
  explicit VelocityFilter(double time_constant) : time_constant_(time_constant) {}
  void add(const spidar::Pose& pose, double h);
  [[nodiscard]] const Eigen::Vector3d& linear() const { return linear_; }
  [[nodiscard]] const Eigen::Vector3d& angular() const { return angular_; }

 private:
  double time_constant_;
  std::optional<spidar::Pose> last_;
  Eigen::Vector3d linear_{Eigen::Vector3d::Zero()};
  Eigen::Vector3d angular_{Eigen::Vector3d::Zero()};
};

/// What is rendered: the wrench on the hand for where its device is.
using Rendering = std::function<haptics::PortWrench(const haptics::CouplingTarget& device)>;

class SpidarChain {
 public:
  struct Options {
    double rate_hz{1000.0};
    double velocity_filter{2e-3};   ///< time constant [s]
    double reference_tension{1.0};  ///< [N]
    spidar::SimulatedParts parts{};
  };

  SpidarChain(const spidar::Geometry& geometry, const Options& options);

  /// One tick: reads the device, renders, sets the tensions, and lets the tick's time pass while the hand wants
  /// `wanted`.
  void tick(const spidar::Pose& wanted, const Rendering& rendering);

  [[nodiscard]] const spidar::SimulatedSpidar& device() const { return device_; }
  /// Of the grip in the last tick, in truth [m/s].
  [[nodiscard]] double speed() const { return speed_; }
  [[nodiscard]] const haptics::CouplingTarget& measured() const { return measured_; }

 private:
  double h_;
  spidar::SimulatedSpidar device_;
  spidar::PoseSolver poses_;
  spidar::TensionSolver tensions_;
  VelocityFilter velocity_;
  haptics::CouplingTarget measured_;
  double speed_{0.0};
};

/// Whether the grip is at rest in the end: velocity below 1 mm/s rms from 1.2 s on.
class RestCheck {
 public:
  static constexpr double kFrom = 1.2;     ///< [s]
  static constexpr double kUntil = 1.5;    ///< [s]
  static constexpr double kAtRest = 1e-3;  ///< [m/s]
  void add(double time, double speed);
  [[nodiscard]] bool holds() const;

 private:
  double sum_{0.0};
  long count_{0};
};

/// Hands that press on a wall.
enum class Press {
  kHand,  ///< the hand of the literature
  kBand,  ///< no hand but an elastic band: nothing that damps
};

/// The ideal wall: one degree of freedom, the grip on the hand's skin, the position rounded to a step, nothing late,
/// nothing that lags; the wall a spring alone.
[[nodiscard]] bool ideal_wall_holds(double stiffness, double rate_hz, double step);

/// A wall of that stiffness [N/m] and damping [N s/m], by the whole chain.
[[nodiscard]] bool chain_wall_holds(const spidar::Geometry& geometry, const SpidarChain::Options& options, Press press,
                                    double stiffness, double damping);

/// The largest stiffness up to which `holds` is true on a ladder of steps of 1 % from 1 kN/m [N/m]; 0 where
/// it never is.
[[nodiscard]] double largest_stiffness(const std::function<bool(double)>& holds);

}  // namespace layfigure::testing
