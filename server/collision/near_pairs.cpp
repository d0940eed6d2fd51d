#include "near_pairs.h"

#include <algorithm>
#include <cmath>

namespace layfigure::collision {
namespace {

using Eigen::Vector3d;

// A body may go this many times as far as it can in one update before the list is made anew: so rarely that the sweep
// costs little, and so near that the list stays short.
constexpr double kUpdatesListed = 16.0;

Box box_of(const Polytope& core, const MovingBody& body, double margin) {
  const Vector3d center = body.R_WB * core.box_center + body.X_WB.position;
  const Vector3d half = body.R_WB.cwiseAbs() * core.box_half + Vector3d::Constant(margin);
  return {center - half, center + half};
}

/// Along the axis on which the boxes are farthest apart; negative if they overlap on all.
double distance_along_axes(const Box& a, const Box& b) { return (a.low - b.high).cwiseMax(b.low - a.high).maxCoeff(); }

}  // namespace

NearPairs::NearPairs(const ShapeSet& shapes)
    : shapes_(&shapes),
      allowances_(shapes.definition().bodies + 1),
      sweep_(static_cast<int>(shapes.cores().size())),
      boxes_(shapes.cores().size()) {}

bool NearPairs::hold(const std::vector<MovingBody>& bodies) const {
  if (!listed_) return false;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const double used = bodies[i].travel - allowances_[i].travel + bodies[i].reach;
    if (!(used <= allowances_[i].margin)) return false;  // NaN: a plane's body turns
  }
  return true;
}

void NearPairs::set_allowances(const std::vector<MovingBody>& bodies) {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    allowances_[i] = {.travel = bodies[i].travel, .margin = (1.0 + kUpdatesListed) * bodies[i].reach};
  }
}

void NearPairs::find(const std::vector<MovingBody>& bodies, UpdateReport& report) {
  set_allowances(bodies);
  list_.clear();
  find_cores(bodies, report);
  find_planes(bodies, report);
  std::sort(list_.begin(), list_.end(), [](const NearPair& p, const NearPair& q) { return p.shapes < q.shapes; });
  listed_ = true;
}

void NearPairs::find_cores(const std::vector<MovingBody>& bodies, UpdateReport& report) {
  const auto& cores = shapes_->cores();
  const double activity = shapes_->definition().activity;
  for (std::size_t i = 0; i < cores.size(); ++i) {
    const int body = cores[i].body;
    boxes_[i] = box_of(cores[i].core, bodies[body], 0.5 * activity + allowances_[body].margin);
  }
  overlapping_.clear();
  report.box_tests += sweep_.find(boxes_, overlapping_);
  for (auto [a, b] : overlapping_) {
    if (!shapes_->may_meet(cores[a].shape, cores[b].shape)) continue;
    if (cores[a].body == 0) std::swap(a, b);
    const double enlarged = activity + allowances_[cores[a].body].margin + allowances_[cores[b].body].margin;
    list_.push_back({.shapes = {cores[a].shape, cores[b].shape},
                     .a = a,
                     .b = b,
                     .plane = false,
                     .bodies = {cores[a].body, cores[b].body},
                     .apart = distance_along_axes(boxes_[a], boxes_[b]) + enlarged});
  }
}

void NearPairs::find_planes(const std::vector<MovingBody>& bodies, UpdateReport& report) {
  const auto& cores = shapes_->cores();
  const double activity = shapes_->definition().activity;
  for (int p = 0; p < static_cast<int>(shapes_->planes().size()); ++p) {
    const PlaneShape& plane = shapes_->planes()[p];
    const MovingBody& body = bodies[plane.body];
    const Vector3d normal = body.R_WB * plane.normal;
    const double height = plane.offset + normal.dot(body.X_WB.position);
    for (int c = 0; c < static_cast<int>(cores.size()); ++c) {
      const Box& box = boxes_[c];
      ++report.box_tests;
      const double lowest = 0.5 * (normal.dot(box.low + box.high) - normal.cwiseAbs().dot(box.high - box.low));
      const double margin = 0.5 * activity + allowances_[plane.body].margin;
      if (lowest - height > margin || !shapes_->may_meet(cores[c].shape, plane.shape)) continue;
      // The box has been enlarged along each axis, so by at least that much along the normal.
      list_.push_back({.shapes = {cores[c].shape, plane.shape},
                       .a = c,
                       .b = p,
                       .plane = true,
                       .bodies = {cores[c].body, plane.body},
                       .apart = lowest - height + 0.5 * activity + allowances_[cores[c].body].margin});
    }
  }
}

}  // namespace layfigure::collision
