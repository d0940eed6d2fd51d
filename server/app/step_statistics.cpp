#include "layfigure/app/step_statistics.h"

#include <algorithm>
#include <cmath>

namespace layfigure::app {

StepStatistics::StepStatistics(double physics_hz)
    : step_us_(1e6 / physics_hz), capacity_(static_cast<std::size_t>(std::ceil(physics_hz))) {
  costs_.reserve(capacity_);
}

void StepStatistics::record(const StepCost& cost) {
  if (costs_.size() < capacity_) {
    costs_.push_back(cost);
    return;
  }
  costs_[next_] = cost;
  next_ = (next_ + 1) % capacity_;
}

StepSummary StepStatistics::summary() const {
  if (costs_.empty()) return {};
  std::vector<double> cpu_us;
  cpu_us.reserve(costs_.size());
  double wall_us = 0.0;
  for (const StepCost& cost : costs_) {
    cpu_us.push_back(cost.cpu_us);
    wall_us += cost.wall_us;
  }
  const auto percentile = [&](double fraction) {
    const auto at = cpu_us.begin() + std::lround(fraction * static_cast<double>(cpu_us.size() - 1));
    std::ranges::nth_element(cpu_us, at);
    return *at;
  };
  const double simulated_us = step_us_ * static_cast<double>(costs_.size());
  return {percentile(0.50), percentile(0.99), std::ranges::max(cpu_us), wall_us > 0.0 ? simulated_us / wall_us : 0.0};
}

}  // namespace layfigure::app
