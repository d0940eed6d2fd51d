#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <span>
#include <vector>

#include "layfigure/dynamics/lcp.h"
#include "layfigure/haptics/local_model.h"

/// The doll at the haptic rate, between physics steps: the haptic thread's part.
///
/// A tick of length h moves the ports by the local model (local_model.h), implicit in its spring and damper and in the
/// virtual couplings (gains K_c, B_c, target x_t, v_t), with the contacts of touch pointers as rows of their own:
///     (M + h D + h^2 K + h (h K_c + B_c)) u+ = M u + h (A^-1 b - K x + f_0) + J_c^T lambda
///     f_0 = K_c (x_t + h v_t - p - h V) + B_c (v_t - V),   Coulomb's law for lambda (lcp.h)
///     p+ = p + h (V + u+) + s,   f = f_0 - (h K_c + B_c) u+,   the hand feels -f
/// A contact's row that would pull drops out, and takes part again where its gap has closed, tick by tick. s is the
/// correction of the hand-over.
///
/// Hand-over. Physics receives the mean f of an interval, so the same impulse, and answers with poses P and velocities
/// that differ by a little from those that the ticks came to. The velocities are taken over as they are; the poses'
/// difference e = P - p is bled off over an interval of physics, e' = -e / H, by the shifts s.
///
/// Energy. A coupling's wrench f does the work f . dp on what is behind it: on the local model and what the shifts
/// move. Physics is done the work F . dP by the mean wrench F over the way dP of the port. What is between the two,
/// model and hand-over, has made energy of nothing where physics was done more work than the couplings did:
///     E = sum over ticks of g . dp  -  sum over intervals of G . dP  <  0
/// Physics steps never create energy themselves (dynamics/step.h), and a coupling with an implicit spring does not; so
/// the whole is passive, but for a loan L = kEnergyLoan once and for all, if E never falls below -L. A loan there must
/// be, since physics, an implicit step, is ahead of the ticks by about V H / 2, so that E swings by about g V H / 2
/// with nothing being lost. Three rules see to the rest, for the sum over all ports (energy may pass from one hand to
/// the other through the doll):
///  1. What physics will be done is foreseen when an interval ends: with the means r G it is
///         W(r) = r G . H (V + H A (drift + r G)),   convex in r, and zero at r = 0
///     The largest r <= 1 with E - W(r) >= -L is taken, so that what physics makes of the interval is paid for; r < 1
///     is a push that the doll loses, seldom and little.
///  2. A shift does the work g . s. Where that is negative, it stretches the coupling's spring and has to be paid for
///     by E: the shifts of a tick are shortened so that E does not fall below -L by them.
///  3. Physics may do otherwise than foreseen (contacts, yield) and leave E below -L. Then the ports yield to their
///     wrenches, s = c g, which relaxes the springs and adds c |g|^2 > 0, until E is -L again, at most at kRelaxSpeed.
/// The two sums of an interval are booked together, when physics has answered; shifts are booked at once.
///
/// What a step loses by itself. A doll that is stopped, or thrown back, within an interval does more work on the hands,
/// tick by tick, than it does against the mean wrench: the force is large while it is fast. Scaling the mean cannot
/// make up for that, and it need not: the doll has lost that energy beside all work, in the step. With v the bodies'
/// velocities before it and v' = J w after it, forces F and joint torques t(w), the step (dynamics/step.h) is
///     J^T (M (v' - v) - H F) + H t(w) = 0
/// which times w is
///     H F . v'  =  v'^T M (v' - v) + H t . w  =  T' - T + |v' - v|_M^2 / 2 + H t . w,   T kinetic energy
/// and H t . w, the torque of the step's end along the way, is at least what the springs, being convex, store and the
/// dampers and the flow use up. So the forces' work exceeds all that by N >= |v' - v|_M^2 / 2, and of all motions with
/// the same change dv of the ports' velocities the least has |dv|_M^2 / 2, M the ports' mass (local_model.h). What this
/// leaves out is of third order in H: the ways of bodies that turn curve away from H v', and M turns with them. So half
/// of it is booked, where E would be below zero, and never more than leads to zero: it is no credit for later. The
/// ledger tells how much; that it is less than steps have lost by their own ledger is tested.
///
/// E starts at zero; rules 1 and 2 do not lower it below -L, and under rule 3 it rises while anything pushes; where
/// nothing pushes no energy is exchanged. So sum g . dp >= sum G . dP - L - (what one interval was mistaken by):
/// however long the hands play, what comes out of the doll beyond what they and physics put in is bounded by a
/// constant.
namespace layfigure::haptics {

/// Where the device wants its pointer's port, world.
struct CouplingTarget {
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};            ///< now [m]
  Eigen::Quaterniond rotation{Eigen::Quaterniond::Identity()};  ///< of the held frame, R_WA
  Eigen::Vector3d velocity{Eigen::Vector3d::Zero()};            ///< [m/s]
  Eigen::Vector3d angular_velocity{Eigen::Vector3d::Zero()};    ///< [rad/s]
};

/// How a port yields at most where energy has to be paid back [m/s]: below what a hand notices.
inline constexpr double kRelaxSpeed = 5e-3;

/// L [J]: a quarter of the dip that a hand-over is allowed, a thousandth of what a hand puts into a joint that it
/// bends.
inline constexpr double kEnergyLoan = 2.5e-4;

/// What a touch pointer's body met in a tick.
struct LocalTouch {
  int body{dynamics::kWorld};                      ///< that it presses hardest on; kWorld: none, or what does not move
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};  ///< of its contacts on it, world [N]
  bool contact{false};
  Eigen::Vector3d normal{Eigen::Vector3d::Zero()};  ///< where it presses hardest, unit, to either side; zero: nowhere
};

/// Of the hand-over [J].
struct HandOverLedger {
  double energy{0.0};     ///< E
  double lowest{0.0};     ///< the least that it has been
  double relaxed{0.0};    ///< given back by rule 3
  double held_back{0.0};  ///< not spent by rule 2
  double lost{0.0};       ///< booked of what steps of physics lost by themselves
};

/// Allocates in its constructor only; its functions lock, log and throw nothing. Not thread-safe. A tick costs
/// O(rows^2) and a small complementarity problem where contacts are near.
class LocalDynamics {
 public:
  LocalDynamics();

  /// A new model, at the same moment as the last end_interval(), or later by some ticks, which then have gone on with
  /// the old one. Ports of the same pointer and place, or of the same touched body, go on from where they are; a touch
  /// pointer's own body, which physics knows from here, also as fast as it is. What an interval was to pay for at a
  /// port that has gone is forgiven only where that makes E smaller.
  void hand_over(const LocalModel& model) noexcept;

  /// One tick of the model's length. One target for each pointer; `on_hands` gets what each hand feels, f turned round.
  /// Before the first hand_over() nothing is felt.
  void tick(std::span<const CouplingTarget> targets, std::span<PortWrench> on_hands) noexcept;

  /// Ends an interval; the means over it of what acted on the doll's ports are what physics is to apply in it. They
  /// stay until the next call.
  [[nodiscard]] std::span<const PortLoad> end_interval() noexcept;

  [[nodiscard]] const HandOverLedger& ledger() const noexcept { return ledger_; }
  [[nodiscard]] Eigen::Vector3d position(int port) const noexcept { return ports_[port].position; }
  [[nodiscard]] const Eigen::Quaterniond& rotation(int port) const noexcept { return ports_[port].rotation; }
  [[nodiscard]] dynamics::BodyVelocity velocity(int port) const noexcept;
  /// In the last tick. Needs a pointer of the last model.
  [[nodiscard]] LocalTouch touched(int pointer) const noexcept;
  /// Complementarity problems so far that were not solved to the tolerance.
  [[nodiscard]] long unsolved() const noexcept { return unsolved_; }

 private:
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostPortRows, 1>;
  using ContactRows = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostContactRows, 1>;
  using Vector6 = Eigen::Matrix<double, 6, 1>;

  struct PortState {
    Eigen::Vector3d position{Eigen::Vector3d::Zero()};
    Eigen::Quaterniond rotation{Eigen::Quaterniond::Identity()};
    Vector6 offset{Vector6::Zero()};  ///< e, [turn; way]
  };

  /// Of a port, since the last end_interval(), and over the one before.
  struct Interval {
    Vector6 sum{Vector6::Zero()};                               ///< of the wrenches
    Vector6 mean{Vector6::Zero()};                              ///< G, given to physics ...
    Eigen::Vector3d physics_position{Eigen::Vector3d::Zero()};  ///< ... which was here when it began
    Eigen::Quaterniond physics_rotation{Eigen::Quaterniond::Identity()};
  };

  /// Which ports the last model had.
  struct Layout {
    int pointers{0};
    int ports{0};
    std::array<int, kMostPointers> pointer{};
    std::array<int, kMostPorts> body{};
    std::array<bool, kMostPorts> own{};
    std::array<double, 3 * kMostPorts> point{};
    std::array<dynamics::BodyVelocity, kMostPorts> velocity{};
  };

  [[nodiscard]] Layout layout() const noexcept;
  [[nodiscard]] int port_before(int port, const Layout& before) const noexcept;
  void account_physics(const Layout& before) noexcept;
  void take_ports(const Layout& before) noexcept;
  void keep_speeds(const Layout& before) noexcept;
  [[nodiscard]] double affordable_share() const noexcept;
  [[nodiscard]] Vector6 coupling_pull(int pointer, const CouplingTarget& target) const noexcept;
  void solve_contacts() noexcept;
  void move() noexcept;
  void shift() noexcept;
  void relax() noexcept;
  void move_by(PortState& port, const Vector6& way) noexcept;

  LocalModel model_;
  bool has_model_{false};
  std::array<PortState, kMostPorts> ports_;
  std::array<Interval, kMostPorts> intervals_;
  std::array<PortLoad, kMostPorts> means_;
  int ticks_{0};         ///< since the last end_interval()
  double moved_{0.0};    ///< g . dp since the last end_interval(), but for shifts
  double given_{0.0};    ///< the same of the interval before
  bool pending_{false};  ///< an interval has been given to physics
  Rows way_;             ///< x
  Rows speed_;           ///< u
  Rows pull_;            ///< f of the couplings
  Rows wrench_;          ///< g
  Rows right_;
  ContactRows impulses_;
  ContactRows bias_;
  std::vector<dynamics::LcpRow> laws_;
  dynamics::LcpWorkspace lcp_;
  HandOverLedger ledger_;
  long unsolved_{0};
};

}  // namespace layfigure::haptics
