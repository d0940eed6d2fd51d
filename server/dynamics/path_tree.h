#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "run.h"

/// The response of the implicit step to impulses, along the paths from the touched bodies to their roots.
///
/// The elimination of the joints (articulated.h) factors the step's matrix, so that its inverse is a sum over the
/// joints: with e the effort [N m s] that an impulse makes at a joint, and X that joint's (A + G)^-1,
///     J M^-1 J^T = sum over joints of  e_i^T X e_j,      joint velocity change  X e
/// An impulse of moment m and force f about a joint's origin makes e = m there, and passes on
///     m' = G X e + r x f',    f' = f - H^T X e
/// to the parent's; a torque n between the joint's two bodies makes e = n and passes on -A X e + r x f', f' = -H^T X e.
/// (Featherstone, Rigid Body Dynamics Algorithms, ch. 6.5 and 9.7, for momenta.)
namespace layfigure::dynamics {

/// What up to three rows do to bodies: columns are the moment and the force of a unit impulse of each row.
struct Jacobian {
  struct Side {
    int body{-1};                                     ///< -1: the world
    Eigen::Matrix3d moment{Eigen::Matrix3d::Zero()};  ///< about the body's origin, world axes
    Eigen::Matrix3d force{Eigen::Matrix3d::Zero()};
  };
  Side a;
  Side b;
  int joint{-1};  ///< the rows are torques between this body and its parent, and nothing else
  Eigen::Matrix3d torque{Eigen::Matrix3d::Zero()};
};

/// A joint on a touched path in one copy, read out of its lane, and the efforts that pass it.
struct PathNode {
  struct Effort {
    int block;
    Eigen::Matrix3d effort;    ///< factor axes; a free root: the moment, world axes
    Eigen::Matrix3d response;  ///< X effort; a free root: angular velocity
    Eigen::Matrix3d force;     ///< of a free root only
    Eigen::Matrix3d velocity;  ///< of a free root only
  };

  int body;
  int parent;  ///< body
  int slot;
  int lane;
  bool factored;  ///< the blocks of the factor are there, and:
  bool free;
  bool fixed;
  Eigen::Quaterniond rotation;  ///< R_WB
  Eigen::Vector3d origin;       ///< p_WBo
  Eigen::Vector3d r;            ///< from the parent's origin
  Eigen::Matrix3d axes;         ///< E: of the factor's torques, columns in the world
  Eigen::Matrix3d motion;       ///< D = E^-T: of its velocities
  Eigen::Matrix3d X, G, A, H;   ///< factor axes (H: rows)
  Eigen::Matrix3d X_linear;     ///< of a free root: M^-1
  std::vector<Effort> efforts;
};

/// The touched paths of one copy and their Delassus matrix. Reuses its memory.
class PathTree {
 public:
  void reserve(int bodies);
  /// Forgets everything.
  void clear();
  /// Forgets the blocks and the factors but keeps the paths' places; call when the factors changed.
  void renew();
  /// Reads the factors that are not there yet.
  template <class T>
  void read_factors(const Plan<T>& plan, const std::vector<Node<T>>& nodes);

  /// Reads the place of a body and of all above it, if not there yet.
  template <class T>
  void touch(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes, int copy, int body);
  [[nodiscard]] const PathNode& at(int body) const { return nodes_[place_[body]]; }

  /// Begins a Delassus matrix of `rows` rows; the factors have been read.
  void begin(int rows);
  /// Adds a block of `count` rows from row `first` on; its bodies have been touched. Blocks are numbered as added.
  void add(const Jacobian& jacobian, int first, int count);
  [[nodiscard]] Eigen::Map<Eigen::MatrixXd> matrix() { return {matrix_.data(), rows_, rows_}; }

  /// Adds the response to the blocks' impulses to the nodes' factors; the next pass over the velocities includes it.
  template <class T>
  void apply(const Eigen::Ref<const Eigen::VectorXd>& impulses, std::vector<Node<T>>& nodes) const;

 private:
  struct Climber {
    int body{-1};
    Eigen::Matrix3d moment;
    Eigen::Matrix3d force;
  };
  struct Block {
    int first;
    int count;
  };

  void climb(Climber& climber);
  void cross(PathNode& node, PathNode::Effort effort);
  [[nodiscard]] Eigen::Vector3d impulse_of(int block, const Eigen::Ref<const Eigen::VectorXd>& impulses) const;

  std::vector<PathNode> nodes_;  ///< the first count_ are in use: parents before children
  int count_{0};
  int factored_{0};         ///< the first of these have their factors, others may
  std::vector<int> place_;  ///< of each body in nodes_, -1: untouched
  std::vector<Block> blocks_;
  std::vector<double> matrix_;
  int rows_{0};
};

}  // namespace layfigure::dynamics
