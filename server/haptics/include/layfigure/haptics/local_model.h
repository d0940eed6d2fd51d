#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <span>

#include "layfigure/dynamics/constraints.h"
#include "layfigure/dynamics/model.h"
#include "layfigure/dynamics/ports.h"
#include "layfigure/dynamics/state.h"
#include "layfigure/dynamics/step.h"
#include "layfigure/haptics/passivity.h"

/// What the haptic thread knows of the doll between two physics steps: a small linear model of the ports that the hands
/// hold or touch, all together, so that each hand feels the other through the doll.
///
/// It is made of a trial step of length H from the newest state, with the wrenches of the last interval. With A, A_D
/// and A_M the trial step's compliances (ports.h: the doll's, that without its springs, that of its masses alone),
///     M = A_M^-1,   D = (A_D^-1 - A_M^-1) / H,   K = (A^-1 - A_D^-1) / H^2
/// are the mass, the damping and the stiffness that the hands feel within the step. A Schur complement grows with what
/// it is taken of, so the inverses rise in this order: M is positive definite, D and K are positive semidefinite, and
/// the local model is passive whatever the doll. Also M + H D + H^2 K = A^-1 exactly.
/// With V the ports' velocities at the interval's beginning, u what they are beyond them and x the way that this makes,
///     M u' + D u + K x = f + A^-1 b,   x' = u,   u(0) = x(0) = 0
/// where b is the acceleration that the trial step would have had without the wrenches f. So a
/// constant f gives, in one implicit step of length H, the velocity V + H (b + A f), the physics step's own, whatever
/// its K; a doll that coasts or rests stays so, to the last digit; and between the two the doll answers at once like
/// the mass that is near to the hand, and after that like its joints.
///
/// Deviations from Susa & Hasegawa (2008): 1. Theirs keeps A alone, v+ = v + h (A f + b). Then a stiff joint feels like
/// the mass H^2 K until the step's end, the more so the slower the physics. M, D and K tell these apart. 2. The trial
/// step makes b that of the interval to come; theirs is that of the one before. 3. Regimes of contacts are solved for
/// in each tick (local_dynamics.h), those of joints are the trial step's. 4. The ports of all hands are coupled.
namespace layfigure::haptics {

inline constexpr int kMostPorts = 6;
inline constexpr int kMostPortRows = 6 * kMostPorts;
inline constexpr int kMostContacts = 12;
inline constexpr int kMostContactRows = 3 * kMostContacts;

/// A virtual coupling's gains, to the device.
struct CouplingGains {
  double stiffness{0.0};          ///< [N/m], >= 0
  double damping{0.0};            ///< [N s/m], >= 0
  double angular_stiffness{0.0};  ///< [N m/rad], >= 0; 0 and no damping: a coupling of 3 degrees of freedom
  double angular_damping{0.0};    ///< [N m s/rad], >= 0
};

/// A wrench on a port, or on a hand; world axes, the torque about the port's point.
struct PortWrench {
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};   ///< [N]
  Eigen::Vector3d torque{Eigen::Vector3d::Zero()};  ///< [N m]
};

/// What a pointer holds or is, for the physics thread.
struct PointerPort {
  int pointer{0};                                                  ///< whose it is: tells it from others
  dynamics::Port port;                                             ///< the held point
  Eigen::Quaterniond orientation{Eigen::Quaterniond::Identity()};  ///< R_BA of the held frame in the body's
  CouplingGains gains;
  bool touches{false};  ///< the body is the pointer's own, a root: the haptic tick moves it and solves its contacts
};

/// What acts on a body of the doll from the haptic side: the mean of an interval.
struct PortLoad {
  int pointer{-1};  ///< whose it is; -1: a body that pointers touch
  dynamics::Port port;
  PortWrench wrench;
};

/// The same as loads of a physics step that begins with `state`.
class PortLoads : public dynamics::Loads {
 public:
  void set(const dynamics::Model& model, const dynamics::State& state, std::span<const PortLoad> loads);
  void add(double time, std::span<dynamics::BodyForce> forces) const override;

 private:
  struct Load {
    int body;
    dynamics::BodyForce force;
  };
  std::array<Load, kMostPorts> loads_{};
  int count_{0};
};

/// A contact of a touch pointer. Rows: normal, two tangents.
struct LocalContact {
  int port_a;
  int port_b;  ///< -1: the world, or what is no port
  double friction;
  double gap;                         ///< along the normal at the interval's beginning [m]
  std::array<double, 3> normal;       ///< from b to a
  std::array<double, 3> a_to_normal;  ///< from port a's point to the contact ...
  std::array<double, 3> b_to_normal;  ///< ... and from port b's, at the interval's beginning, world
};

/// The model of one interval. Plain data, so that a device::LatestValue carries it; matrices by columns, `rows` by
/// `rows`.
struct LocalModel {
  template <int kSize>
  using Numbers = std::array<double, kSize>;

  int pointers{0};  ///< the first ports are theirs, one each
  int ports{0};     ///< the others are bodies that they touch
  int contacts{0};
  int left_out{0};     ///< contacts, or touched bodies, beyond what there is room for: those that are furthest
  double tick{0.0};    ///< h that `response` is for [s]
  double length{0.0};  ///< H [s]
  std::array<int, kMostPointers> pointer{};  ///< whose port k is
  std::array<int, kMostPorts> body{};
  std::array<bool, kMostPorts> own{};  ///< a touch pointer's own body: not known to physics but by what it touches
  Numbers<3 * kMostPorts> point{};     ///< in the bodies' frames
  std::array<CouplingGains, kMostPointers> gains{};
  Numbers<3 * kMostPorts> position{};                   ///< of the ports' points
  Numbers<4 * kMostPorts> rotation{};                   ///< R_WA of the held frames, x y z w
  Numbers<kMostPortRows> velocity{};                    ///< V
  Numbers<kMostPortRows> drift{};                       ///< A^-1 b
  Numbers<kMostPortRows * kMostPortRows> compliance{};  ///< A
  Numbers<kMostPortRows * kMostPortRows> mass{};        ///< M
  Numbers<kMostPortRows * kMostPortRows> spring{};      ///< K
  Numbers<kMostPortRows * kMostPortRows> response{};    ///< S = (M + h D + h^2 K + h (h K_c + B_c))^-1
  std::array<LocalContact, kMostContacts> contact{};
  Numbers<kMostPortRows * kMostContactRows> contact_jacobian{};     ///< J_c^T
  Numbers<kMostPortRows * kMostContactRows> contact_response{};     ///< S J_c^T
  Numbers<kMostContactRows * kMostContactRows> contact_delassus{};  ///< J_c S J_c^T

  [[nodiscard]] int rows() const { return 6 * ports; }
};

/// What a trial step was.
struct TrialStep {
  const dynamics::State& before;                ///< the state that it began with
  dynamics::Workspace& workspace;               ///< that it was made in
  std::span<const PortLoad> loads;              ///< that acted in it, beside what the doll's own scene has
  std::span<const dynamics::Contact> contacts;  ///< of touch pointers' bodies, left out of it
  double length;                                ///< H [s]
};

/// Puts a touch pointer's own body, a root, where the haptic tick has moved it.
void put_body(const dynamics::Model& model, int body, const Eigen::Quaterniond& rotation,
              const Eigen::Vector3d& position, const dynamics::BodyVelocity& velocity, dynamics::State& state);

/// Makes local models on the physics thread.
class LocalModeler {
 public:
  explicit LocalModeler(const dynamics::Model& model);
  ~LocalModeler();
  LocalModeler(LocalModeler&&) noexcept;
  LocalModeler& operator=(LocalModeler&&) noexcept;

  /// The local model of the interval that the trial step went through, for ticks of length `tick`. False where the
  /// workspace has no factors (ports.h): the last model is then still as good as any. At most kMostPointers pointers.
  /// O(path) and two eliminations of the tree; O(rows^3). Allocates only where there is more than ever before.
  [[nodiscard]] bool make(const TrialStep& trial, std::span<const PointerPort> pointers, double tick,
                          LocalModel& result);

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace layfigure::haptics
