#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <span>

/// Time-domain passivity: an observer of the energy that each pointer's hand and the rendered doll exchange, and a
/// controller that takes back what the rendering made of nothing (Hannaford & Ryu 2002).
///
/// With f the wrench that the hand exerts on what is rendered, the opposite of the one that the device is told, and x
/// the device's pose, held between ticks,
///     E[k] = E[k-1] + f[k-1] . (x[k] - x[k-1])
/// is exactly what has flowed in. A passive rendering never lets it fall below -(energy that it held at first). Where
/// E + credit < 0, the controller adds damping for the tick to come,
///     f += alpha v,   alpha = -(E + credit) / (T |v|^2)   at most max_damping
/// which at this velocity pays the debt in one tick; what the cap leaves is still in E, and is paid in the ticks that
/// follow. Torques and turns count with the grip's radius r: |v|^2 stands for |v|^2 + r^2 |w|^2, the damping torque is
/// alpha r^2 w.
///
/// Hands that hold one doll may exchange energy through it: what one puts in may come out at the other. So pointers are
/// judged each by itself, or together by their sum.
namespace layfigure::haptics {

inline constexpr int kMostPointers = 4;

struct PassivityOptions {
  enum class Judge { kOff, kEach, kTogether };
  Judge judge{Judge::kOff};
  double max_damping{20.0};  ///< [N s/m], >= 0: what the device renders stably by itself
  double radius{0.03};       ///< r of the grip [m], > 0
};

/// Of one pointer, or of all together [J].
struct PassivityLedger {
  double energy{0.0};      ///< E: what has flowed in
  double lowest{0.0};      ///< the least that E has been
  double dissipated{0.0};  ///< by the controller's damping
  double credit{0.0};      ///< that has been granted
};

/// What a device does in a tick.
struct PassivityPort {
  Eigen::Vector3d force;         ///< on the hand [N]; the controller adds its damping
  Eigen::Vector3d torque;        ///< on the hand [N m]
  Eigen::Vector3d displacement;  ///< of the device since the last tick [m]
  Eigen::Vector3d turn;          ///< rotation vector of its turn since the last tick [rad]
};

/// Allocates, locks and throws nothing. Off it returns at once. Not thread-safe.
class Passivity {
 public:
  void configure(const PassivityOptions& options) noexcept { options_ = options; }

  /// A tick of length T > 0 of all pointers, at most kMostPointers: observes what the wrenches of the last tick did on
  /// the way to here, and corrects the wrenches of this one.
  void tick(double T, std::span<PassivityPort> ports) noexcept;

  /// What the device at `pointer` will exert until the next tick, where that is less than tick() was told: a guard has
  /// cut it.
  void hold(int pointer, const Eigen::Vector3d& force, const Eigen::Vector3d& torque) noexcept;

  /// Energy that may come out at `pointer` though it did not go in there: what the doll held, or was given by gravity
  /// or by something else [J].
  void grant(int pointer, double energy) noexcept;

  /// Forgets a pointer that lets go, or all of them.
  void reset(int pointer) noexcept;
  void reset() noexcept;

  [[nodiscard]] const PassivityLedger& ledger(int pointer) const noexcept { return ledgers_[pointer]; }
  [[nodiscard]] const PassivityLedger& together() const noexcept { return together_; }

 private:
  struct Held {
    Eigen::Vector3d force{Eigen::Vector3d::Zero()};
    Eigen::Vector3d torque{Eigen::Vector3d::Zero()};
    Eigen::Vector3d damping_force{Eigen::Vector3d::Zero()};
    Eigen::Vector3d damping_torque{Eigen::Vector3d::Zero()};
  };

  void observe(int pointer, const PassivityPort& port) noexcept;
  void damp(double T, double debt, std::span<PassivityPort> ports, int first) noexcept;

  PassivityOptions options_;
  std::array<Held, kMostPointers> held_{};
  std::array<PassivityLedger, kMostPointers> ledgers_{};
  PassivityLedger together_;
};

}  // namespace layfigure::haptics
