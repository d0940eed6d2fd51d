#include "layfigure/haptics/softness.h"

#include <algorithm>
#include <cassert>

namespace layfigure::haptics {

void Softness::set(double factor) {
  assert(factor >= 0.0 && factor <= kMaxSoftness);
  factors_.whole = factor;
  std::ranges::fill(factors_.own, std::nullopt);
}

void Softness::set(int body, double factor) {
  assert(factor >= 0.0 && factor <= kMaxSoftness);
  factors_.own[body] = factor;
}

void Softness::apply(bool held, const dynamics::Model& model, dynamics::State& state) {
  const std::size_t count = factors_.own.size();
  const bool scales = held || std::ranges::find(loose_, true) != loose_.end();
  if (scales && saved_.empty()) {
    for (std::size_t i = 0; i < count; ++i) saved_.push_back(state.bodies[i].yield_scale);
  }
  if (saved_.empty()) return;
  const auto wanted = [&](std::size_t i) {
    if (loose_[i]) return 0.0;
    return held ? saved_[i] * factor(static_cast<int>(i)) : saved_[i];
  };
  bool changes = false;
  for (std::size_t i = 0; i < count; ++i) changes = changes || state.bodies[i].yield_scale != wanted(i);
  if (changes) {
    dynamics::wake(model, state);
    for (std::size_t i = 0; i < count; ++i) state.bodies[i].yield_scale = wanted(i);
  }
  if (!scales) saved_.clear();
}

}  // namespace layfigure::haptics
