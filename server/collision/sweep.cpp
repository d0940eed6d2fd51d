#include "sweep.h"

#include <algorithm>
#include <numeric>

namespace layfigure::collision {
namespace {

int widest_axis(const std::vector<Box>& boxes) {
  Eigen::Vector3d low = boxes.front().low, high = low;
  for (const auto& box : boxes) {
    low = low.cwiseMin(box.low);
    high = high.cwiseMax(box.low);
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);
  return axis;
}

}  // namespace

Sweep::Sweep(int boxes) : order_(boxes) { std::iota(order_.begin(), order_.end(), 0); }

int Sweep::find(const std::vector<Box>& boxes, std::vector<std::pair<int, int>>& pairs) {
  if (boxes.empty()) return 0;
  const int axis = widest_axis(boxes);
  const auto low = [&](int i) { return boxes[i].low[axis]; };
  // Insertion sort: linear where little moved since the last time.
  for (std::size_t k = 1; k < order_.size(); ++k) {
    const int moving = order_[k];
    std::size_t to = k;
    for (; to > 0 && low(order_[to - 1]) > low(moving); --to) order_[to] = order_[to - 1];
    order_[to] = moving;
  }
  int compared = 0;
  for (std::size_t k = 0; k < order_.size(); ++k) {
    const Box& box = boxes[order_[k]];
    for (std::size_t other = k + 1; other < order_.size() && low(order_[other]) <= box.high[axis]; ++other) {
      ++compared;
      if (overlap(box, boxes[order_[other]])) pairs.push_back(std::minmax(order_[k], order_[other]));
    }
  }
  return compared;
}

}  // namespace layfigure::collision
