#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "constraint_rows.h"
#include "layfigure/dynamics/lcp.h"
#include "path_tree.h"

namespace layfigure::dynamics {

/// The constraints of one copy of the doll.
class ConstraintSet {
 public:
  /// Makes room for a model of so many bodies.
  void reserve(int bodies);

  /// Makes room for the forces of so many contacts and ties; those of the last step stay.
  void reserve_forces(const Inputs& inputs);

  /// A step begins: where its sub-steps look for their impulses first. Forgets the last step's reports.
  void start(std::span<const ConstraintMemory> memory, const Inputs& inputs);

  /// No rows.
  void clear();
  /// A sub-step begins: makes the rows of the ties and of the contacts that acted last, and watches the other contacts,
  /// with the configuration as the nodes have it.
  template <class T>
  void gather(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes, int copy);
  /// The joints have been eliminated anew: nothing is applied to the new factors yet.
  void renew();
  /// Takes in the rows that the velocities would violate, solves for the impulses and applies them to the factors.
  /// False if there was no such row, so that the velocities are final.
  template <class T>
  bool solve(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes, int copy);
  /// The velocities are final: forces, work and what to remember.
  template <class T>
  void finish(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes, int copy);

  /// The line search's part. The newest iterate's rows as they move with the velocities in the nodes.
  template <class T>
  void measure(const Plan<T>& plan, const std::vector<Node<T>>& nodes, int copy);
  /// lambda . (change of the unilateral rows' velocity), at that part of the way from the last accepted iterate.
  [[nodiscard]] double slope(double fraction) const;
  void accept(double fraction, bool first);

  [[nodiscard]] const std::vector<ConstraintMemory>& memory() const { return memory_; }
  /// The last sub-step's, with what they exerted.
  [[nodiscard]] std::span<const ConstraintBlock> blocks() const { return blocks_; }
  [[nodiscard]] const ConstraintReport& report() const { return report_; }
  [[nodiscard]] const Eigen::Vector3d& contact_force(int index) const { return contact_forces_[index]; }
  [[nodiscard]] const BodyForce& tie_force(int index) const { return tie_forces_[index]; }
  /// The same rows acted, in the same way, in all sub-steps of both runs.
  [[nodiscard]] bool agrees_with(const ConstraintSet& other) const {
    return steady_ && other.steady_ && pattern_ == other.pattern_;
  }

 private:
  [[nodiscard]] const ConstraintMemory* recall(std::uint64_t key);
  void add(ConstraintBlock&& block, double h);
  template <class T>
  void take_limits(const StepContext& context, const Plan<T>& plan, std::vector<Node<T>>& nodes, int copy);
  template <class T>
  void take_bounds(LimitedJoint& joint, const StepContext& context, const Plan<T>& plan,
                   const std::vector<Node<T>>& nodes, int copy);
  template <class T>
  [[nodiscard]] Eigen::Vector3d row_velocity(const ConstraintBlock& block, const Plan<T>& plan,
                                             const std::vector<Node<T>>& nodes, int copy) const;
  template <class T>
  [[nodiscard]] double normal_velocity(const ContactWatch& watch, const Plan<T>& plan,
                                       const std::vector<Node<T>>& nodes, int copy) const;
  template <class T>
  [[nodiscard]] bool activate(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes,
                              int copy);
  void assemble();
  void solve_rows();

  PathTree tree_;
  std::vector<ConstraintBlock> blocks_;  ///< the problem's rows
  std::vector<ContactWatch> watched_;    ///< the other contacts
  std::vector<LimitedJoint> limited_;
  std::vector<ConstraintMemory> memory_;
  std::size_t cursor_{0};  ///< in memory_: where the last key was found
  int rows_{0};            ///< of the blocks
  static constexpr int kNone = -1;
  int solved_rows_{kNone};  ///< size of the last problem since renew()

  // the problem
  std::vector<LcpRow> laws_;
  std::vector<double> bias_;
  std::vector<double> impulses_;
  double largest_speed_{0.0};  ///< among the rows' biases
  LcpWorkspace lcp_;

  std::vector<Eigen::Vector3d> contact_forces_;
  std::vector<BodyForce> tie_forces_;
  ConstraintReport report_;
  std::uint64_t pattern_{0};
  bool steady_{true};
  bool first_sub_step_{true};
};

}  // namespace layfigure::dynamics
