#pragma once

#include "layfigure/device/device.h"
#include "layfigure/spidar/pose_solver.h"
#include "layfigure/spidar/simulated_device.h"
#include "layfigure/spidar/tension_solver.h"

namespace layfigure::device {

/// A SPIDAR's geometry frame (y up, z towards the user) in the device's frame (z up, y away).
[[nodiscard]] Reading to_reading(const spidar::Pose& pose);
[[nodiscard]] spidar::Pose to_spidar(const Eigen::Vector3d& position, const Eigen::Quaterniond& rotation);
[[nodiscard]] spidar::Wrench to_spidar(const Wrench& wrench);
[[nodiscard]] Wrench to_device(const spidar::Wrench& wrench);

/// What a SPIDAR can do at its centre, and how far its grip gets.
[[nodiscard]] Info spidar_info(const spidar::Geometry& geometry);

/// The tension of every string where nothing is asked for [N].
[[nodiscard]] double reference_tension(const spidar::Geometry& geometry);

/// From lengths to readings and from wrenches to tensions. Not movable: its solvers look at its geometry.
class SpidarKinematics {
 public:
  explicit SpidarKinematics(spidar::Geometry geometry);
  SpidarKinematics(const SpidarKinematics&) = delete;

  [[nodiscard]] const spidar::Geometry& geometry() const { return geometry_; }
  /// kInvalid, with the last pose, for lengths that fit none well.
  [[nodiscard]] Reading read(const spidar::Lengths& lengths) noexcept;
  /// At the last pose that was good. No wrench at a pose that is not is the least tension on every string: no balance
  /// of larger ones can be relied on.
  [[nodiscard]] const spidar::Tensions& tensions(const Wrench& wrench) noexcept;

 private:
  spidar::Geometry geometry_;
  spidar::PoseSolver poses_;
  spidar::TensionSolver solver_;
  spidar::Pose pose_;
  bool good_{false};
  spidar::TensionSolution solution_;
};

/// A SPIDAR with the hand that holds it, all computed. Each read() lets the time pass that went by since the last, in
/// which the tensions of the last write() pull; no write for kWatchdog lets the strings go, as a real one's controller
/// does. The same calls give the same bits.
class SimulatedSpidarDriver : public Driver {
 public:
  static constexpr double kWatchdog = 0.01;  ///< [s]

  explicit SimulatedSpidarDriver(spidar::Geometry geometry);

  [[nodiscard]] const Info& info() const noexcept override { return info_; }
  [[nodiscard]] Reading read(double time) noexcept override;
  void write(const Wrench& wrench) noexcept override;
  /// The strings' wrench on the grip, at this moment.
  [[nodiscard]] Wrench exerted() const noexcept override;
  void close() noexcept override;
  void aim(const Eigen::Vector3d& position, const Eigen::Quaterniond& rotation) noexcept override;

  [[nodiscard]] spidar::SimulatedFaults& faults() { return spidar_.faults(); }
  [[nodiscard]] const spidar::SimulatedSpidar& spidar() const { return spidar_; }

 private:
  SpidarKinematics kinematics_;
  spidar::SimulatedSpidar spidar_;
  Info info_;
  spidar::Pose wanted_;
  double time_{0.0};
  double last_write_{0.0};
  bool started_{false};
  bool closed_{false};
};

}  // namespace layfigure::device
