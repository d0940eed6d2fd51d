#include "layfigure/app/pointer_input.h"

#include <algorithm>
#include <utility>

namespace layfigure::app {

void PointerInput::receive(std::string client_id, std::int64_t sequence, std::int64_t step, double longest_interval) {
  const double interval = std::clamp(static_cast<double>(step - received_at_step_), 1.0, longest_interval);
  message_interval_ = sequence_ == 0 ? interval : 0.5 * (message_interval_ + interval);
  client_id_ = std::move(client_id);
  sequence_ = sequence;
  received_at_step_ = step;
}

}  // namespace layfigure::app
