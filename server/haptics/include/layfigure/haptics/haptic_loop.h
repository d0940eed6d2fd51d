#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "layfigure/device/latest_value.h"
#include "layfigure/dynamics/step.h"
#include "layfigure/haptics/device_set.h"
#include "layfigure/haptics/glide.h"
#include "layfigure/haptics/local_dynamics.h"
#include "layfigure/haptics/local_model.h"
#include "layfigure/haptics/pose_rate.h"
#include "layfigure/haptics/soft_tip.h"
#include "layfigure/haptics/tick_record.h"
#include "layfigure/haptics/workspace_map.h"

/// The haptic rate between physics steps: in each tick of h = H / n
///     devices read -> local dynamics -> passivity -> guards -> devices written
/// and once in an interval of H, the length of a physics step, an exchange with physics through two latest-value slots:
///     haptics -> physics   HapticReport: the mean wrenches of the interval that has ended, where fingertips are
///     physics -> haptics   HapticOrders: the local model of the interval to come, what the pointers hold, their maps
/// The two take turns. The haptic side ends an interval when n ticks have passed and its last report was answered; the
/// physics side steps when there is a report, and answers. So no wrench is applied twice and none is lost, whichever of
/// them is late: a late answer makes one interval longer, and those that follow shorter, since their ends lie on the
/// grid of n ticks. What is more than kMostBehind off the grid is dropped. An answer that is overdue by more than
/// kPatience takes the forces away (device::Fault::kStalled).
namespace layfigure::haptics {

/// Behind an answer's time, until it is a fault [s]: as long as the guards wait for a device.
inline constexpr double kPatience = 4e-3;
/// What is made up for at most [s].
inline constexpr double kMostBehind = 0.1;

/// What the tick is to know of a device's pointer.
struct ServedHand {
  bool has_tool{false};
  WorkspaceMap map;
  Eigen::Vector3d position_offset{Eigen::Vector3d::Zero()};  ///< of the tool from the pointer, see Grip
  Eigen::Quaterniond rotation_offset{Eigen::Quaterniond::Identity()};
  PointerPose wanted;  ///< by a simulated device's hand at the interval's end
};

/// Physics to haptics.
struct HapticOrders {
  static constexpr bool kCopiesPlainly = true;

  bool sound{true};       ///< the simulation goes on; if not, nothing is exerted
  bool has_model{false};  ///< else the last one is as good as any
  LocalModel model;
  std::array<ServedHand, kMostPointers> hands;  ///< of the devices
};

/// What a tool did in the interval.
struct ServedTool {
  bool has_port{false};                               ///< it was in the local model
  dynamics::BodyForce force;                          ///< of its coupling on what it holds, mean, at the held point
  LocalTouch touched;                                 ///< of a fingertip
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};  ///< of the port at the interval's end, world
  Eigen::Quaterniond rotation{Eigen::Quaterniond::Identity()};
  dynamics::BodyVelocity velocity{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
};

/// Haptics to physics.
struct HapticReport {
  static constexpr bool kCopiesPlainly = true;

  int load_count{0};
  std::array<PortLoad, kMostPorts> loads;
  std::array<ServedTool, kMostPointers> tools;  ///< of the devices' pointers
  std::array<DeviceSeen, kMostPointers> devices;
  HandOverLedger ledger;
  TickRecord ticks;
  double next{0.0};  ///< time of the next report, if this one is answered by then [s]
};

/// One thread calls tick(), one all the others; both may be the same. Neither allocates, locks, logs or throws.
class HapticLoop {
 public:
  /// At most kMostPointers devices. `ticks` of length `tick` [s] make an interval.
  HapticLoop(DeviceSet& devices, int ticks, double tick);

  /// `periods` after the last: more than one where ticks were missed. `time` [s]: see device::Driver.
  void tick(double time, int periods) noexcept;

  // Physics.
  [[nodiscard]] bool has_report() const noexcept { return reports_.has_new(); }
  [[nodiscard]] bool take(HapticReport& report) noexcept { return reports_.read(report); }
  void give(const HapticOrders& orders) noexcept { orders_.write(orders); }

  [[nodiscard]] int ticks() const { return ticks_; }
  [[nodiscard]] double tick_length() const { return h_; }

 private:
  struct Hand {
    ServedHand served;
    PointerPose aim;  ///< of a simulated device's hand
    Glide glide;
    PoseRate rate;
    SoftTip soft;                                     ///< of a fingertip
    Eigen::Vector3d normal{Eigen::Vector3d::Zero()};  ///< of what it pressed on in the last tick, see TipMotion
  };

  void receive() noexcept;
  void read(double time, int periods) noexcept;
  [[nodiscard]] CouplingTarget target_of(int port, Hand& hand) noexcept;
  void render() noexcept;
  void exert(double time) noexcept;
  void end_interval(double time, int periods) noexcept;
  void report() noexcept;
  [[nodiscard]] bool is_overdue(double time) const noexcept;

  DeviceSet& devices_;
  int ticks_;
  double h_;
  device::LatestValue<HapticOrders> orders_;
  device::LatestValue<HapticReport> reports_;

  LocalDynamics local_;
  bool sound_{true};
  int pointers_{0};                                 ///< of the local model
  std::array<int, kMostPointers> pointer_{};        ///< whose its ports are
  std::array<bool, kMostPointers> is_fingertip_{};  ///< a port that the ticks move
  std::array<CouplingGains, kMostPointers> gains_{};
  std::array<Hand, kMostPointers> hands_;
  std::array<CouplingTarget, kMostPointers> targets_;
  std::array<PortWrench, kMostPointers> felt_;
  std::array<PortWrench, kMostPointers> sums_;  ///< of what was felt since the interval's beginning, by devices
  int summed_{0};
  int elapsed_{0};        ///< periods since the interval's beginning on the grid
  bool answered_{false};  ///< physics has answered the last report
  double asked_{0.0};     ///< time of that report
  bool started_{false};
  HapticReport report_;
};

}  // namespace layfigure::haptics
