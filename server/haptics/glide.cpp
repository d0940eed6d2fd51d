#include "layfigure/haptics/glide.h"

#include <cassert>

#include "layfigure/math/rotation.h"

namespace layfigure::haptics {

void Glide::start(const PointerPose& from, const PointerPose& to, std::int64_t steps) {
  assert(steps > 0);
  from_ = from;
  to_ = to;
  shift_ = to.position - from.position;
  turn_ = math::log_rotation(to.rotation * from.rotation.conjugate());
  steps_ = steps;
  done_ = 0;
}

PointerPose Glide::advance() {
  assert(moving());
  ++done_;
  if (!moving()) return to_;
  const double fraction = static_cast<double>(done_) / static_cast<double>(steps_);
  return {.position = from_.position + fraction * shift_,
          .rotation = math::exp_rotation(fraction * turn_) * from_.rotation};
}

}  // namespace layfigure::haptics
