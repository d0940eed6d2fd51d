#include "path_tree.h"

#include <utility>

#include "lane_transfer.h"
#include "path_factors.h"

namespace layfigure::dynamics {
namespace {

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& r) {
  Eigen::Matrix3d m;
  m << 0.0, -r.z(), r.y(), r.z(), 0.0, -r.x(), -r.y(), r.x(), 0.0;
  return m;
}

template <class T>
void read_factor(const Constants<T>& constants, const SlotFactor<T>& factor, PathNode& node) {
  const int k = node.lane;
  node.factored = true;
  node.free = math::lane(constants.free, k) > 0.0;
  node.fixed = math::lane(constants.fixed, k) > 0.0;
  if (node.free) {
    // Block elimination of the linear velocity, as in solve_free_root().
    node.X_linear = lane_matrix(math::inverse(factor.own.M), k);
    node.H = lane_matrix(factor.own.H, k);
    node.X = (lane_matrix(factor.own.A, k) - node.H * node.X_linear * node.H.transpose()).inverse();
    return;
  }
  node.axes = lane_matrix(factor.axes, k);
  node.motion = lane_matrix(factor.motion, k);
  node.A = lane_matrix(factor.A, k);
  node.G = lane_matrix(factor.G, k);
  node.X = lane_matrix(factor.X, k);
  node.H = lane_matrix(factor.H, k);
}

template <class T>
void add_to_lane(Vec3<T>& sum, int k, const Eigen::Vector3d& change) {
  math::set_lane(sum, k, math::lane(sum, k) + change);
}

}  // namespace

void PathTree::reserve(int bodies) { place_.assign(bodies, -1); }

void PathTree::clear() {
  for (int k = 0; k < count_; ++k) place_[nodes_[k].body] = -1;
  count_ = factored_ = 0;
  blocks_.clear();
}

void PathTree::renew() {
  factored_ = 0;
  blocks_.clear();
  for (int k = 0; k < count_; ++k) {
    nodes_[k].efforts.clear();
    nodes_[k].factored = false;
  }
}

template <class T>
void PathTree::read_factors(const Plan<T>& plan, const std::vector<Node<T>>& nodes) {
  for (; factored_ < count_; ++factored_) {
    if (nodes_[factored_].factored) continue;
    const int slot = nodes_[factored_].slot;
    const SlotFactor<T> factor = factor_of(plan, nodes, slot);
    for (int k = factored_; k < count_; ++k) {
      if (nodes_[k].slot == slot) read_factor(plan.constants[slot], factor, nodes_[k]);
    }
  }
}

template <class T>
void PathTree::touch(const StepContext& context, const Plan<T>& plan, const std::vector<Node<T>>& nodes, int copy,
                     int body) {
  if (body < 0 || place_[body] >= 0) return;
  const Schedule& schedule = plan.schedule;
  const int slot = schedule.slot_of(copy, body);
  const int lane = schedule.lane_of(copy, body);
  const Task& task = schedule.tasks(slot)[lane];
  const bool root = task.parent_slot == schedule.size();
  const int parent = root ? -1 : schedule.tasks(task.parent_slot)[task.parent_lane].body;
  touch(context, plan, nodes, copy, parent);
  if (count_ == static_cast<int>(nodes_.size())) nodes_.emplace_back();
  PathNode& node = nodes_[count_];
  place_[body] = count_++;
  node.body = body;
  node.parent = parent;
  node.slot = slot;
  node.lane = lane;
  node.rotation = math::lane(nodes[slot].orientation, lane);
  node.r = math::lane(nodes[slot].r, lane);
  node.origin = root ? context.copies[copy].from[body].position : Eigen::Vector3d(at(parent).origin + node.r);
  node.efforts.clear();
  node.factored = false;
}

void PathTree::begin(int rows) {
  rows_ = rows;
  blocks_.clear();
  for (int k = 0; k < count_; ++k) nodes_[k].efforts.clear();
  matrix_.assign(static_cast<std::size_t>(rows) * rows, 0.0);
}

void PathTree::add(const Jacobian& jacobian, int first, int count) {
  blocks_.push_back({first, count});
  Climber p{.body = jacobian.a.body, .moment = jacobian.a.moment, .force = jacobian.a.force};
  Climber q{.body = jacobian.b.body, .moment = jacobian.b.moment, .force = jacobian.b.force};
  if (jacobian.joint >= 0) {
    PathNode& node = nodes_[place_[jacobian.joint]];
    const Eigen::Matrix3d effort = node.motion.transpose() * jacobian.torque;
    const Eigen::Matrix3d response = node.X * effort;
    cross(node, {.block = 0, .effort = effort, .response = response, .force = {}, .velocity = {}});
    p.body = node.parent;
    p.force = -node.H.transpose() * response;
    p.moment = -node.axes * (node.A * response) + cross_matrix(node.r) * p.force;
  }
  // Parents have lower numbers than their children: the higher of the two climbs until they meet.
  while (p.body >= 0 || q.body >= 0) {
    if (p.body < q.body) std::swap(p, q);
    if (p.body == q.body) {
      p.moment += q.moment;
      p.force += q.force;
      q.body = -1;
    }
    climb(p);
  }
}

void PathTree::climb(Climber& climber) {
  PathNode& node = nodes_[place_[climber.body]];
  climber.body = node.parent;
  if (node.fixed) return;
  if (node.free) {
    const Eigen::Matrix3d linear = node.X_linear * climber.force;
    const Eigen::Matrix3d angular = node.X * (climber.moment - node.H * linear);
    const Eigen::Matrix3d velocity = linear - node.X_linear * (node.H.transpose() * angular);
    cross(node,
          {.block = 0, .effort = climber.moment, .response = angular, .force = climber.force, .velocity = velocity});
    return;
  }
  const Eigen::Matrix3d effort = node.motion.transpose() * climber.moment;
  const Eigen::Matrix3d response = node.X * effort;
  cross(node, {.block = 0, .effort = effort, .response = response, .force = {}, .velocity = {}});
  climber.force -= node.H.transpose() * response;
  climber.moment = node.axes * (node.G * response) + cross_matrix(node.r) * climber.force;
}

/// Adds what the newest block's effort at a node has in common with each one there.
void PathTree::cross(PathNode& node, PathNode::Effort effort) {
  effort.block = static_cast<int>(blocks_.size()) - 1;
  node.efforts.push_back(effort);
  const Block& mine = blocks_[effort.block];
  for (const PathNode::Effort& other : node.efforts) {
    const Block& theirs = blocks_[other.block];
    Eigen::Matrix3d common = effort.effort.transpose() * other.response;
    if (node.free) common += effort.force.transpose() * other.velocity;
    for (int j = 0; j < theirs.count; ++j) {
      for (int i = 0; i < mine.count; ++i) {
        matrix_[static_cast<std::size_t>(theirs.first + j) * rows_ + mine.first + i] += common(i, j);
      }
    }
  }
}

Eigen::Vector3d PathTree::impulse_of(int block, const Eigen::Ref<const Eigen::VectorXd>& impulses) const {
  Eigen::Vector3d impulse = Eigen::Vector3d::Zero();
  for (int i = 0; i < blocks_[block].count; ++i) impulse[i] = impulses[blocks_[block].first + i];
  return impulse;
}

template <class T>
void PathTree::apply(const Eigen::Ref<const Eigen::VectorXd>& impulses, std::vector<Node<T>>& nodes) const {
  for (int k = 0; k < count_; ++k) {
    const PathNode& node = nodes_[k];
    Eigen::Vector3d angular = Eigen::Vector3d::Zero();
    Eigen::Vector3d linear = Eigen::Vector3d::Zero();
    for (const PathNode::Effort& effort : node.efforts) {
      const Eigen::Vector3d impulse = impulse_of(effort.block, impulses);
      angular += (node.free ? effort.effort : effort.response) * impulse;
      if (node.free) linear += effort.force * impulse;
    }
    Node<T>& target = nodes[node.slot];
    add_to_lane(node.free ? target.root.b_angular : target.y, node.lane, angular);
    if (node.free) add_to_lane(target.root.b_linear, node.lane, linear);
  }
}

template void PathTree::read_factors(const Plan<double>&, const std::vector<Node<double>>&);
template void PathTree::read_factors(const Plan<math::Lanes4>&, const std::vector<Node<math::Lanes4>>&);
template void PathTree::touch(const StepContext&, const Plan<double>&, const std::vector<Node<double>>&, int, int);
template void PathTree::touch(const StepContext&, const Plan<math::Lanes4>&, const std::vector<Node<math::Lanes4>>&,
                              int, int);
template void PathTree::apply(const Eigen::Ref<const Eigen::VectorXd>&, std::vector<Node<double>>&) const;
template void PathTree::apply(const Eigen::Ref<const Eigen::VectorXd>&, std::vector<Node<math::Lanes4>>&) const;

}  // namespace layfigure::dynamics
