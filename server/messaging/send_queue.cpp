#include "layfigure/messaging/send_queue.h"

#include <algorithm>
#include <utility>

namespace layfigure::messaging {

bool SendQueue::push(std::shared_ptr<const Frame> frame) {
  const std::size_t size = frame->bytes.size();
  while (bytes_ + size > limits_.state && drop_oldest_state()) {
  }
  if (bytes_ + size > limits_.total) return false;
  bytes_ += size;
  frames_.push_back(std::move(frame));
  return true;
}

std::shared_ptr<const Frame> SendQueue::pop() {
  if (frames_.empty()) return nullptr;
  std::shared_ptr<const Frame> frame = std::move(frames_.front());
  frames_.pop_front();
  bytes_ -= frame->bytes.size();
  return frame;
}

bool SendQueue::drop_oldest_state() {
  const auto oldest = std::ranges::find_if(frames_, [](const auto& frame) { return frame->is_state; });
  if (oldest == frames_.end()) return false;
  bytes_ -= (*oldest)->bytes.size();
  frames_.erase(oldest);
  ++dropped_;
  return true;
}

}  // namespace layfigure::messaging
