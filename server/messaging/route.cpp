#include "layfigure/messaging/route.h"

#include <spdlog/spdlog.h>

namespace layfigure::messaging {

void Route::take(ByteView bytes) const noexcept {
  try {
    handler(bytes);
  } catch (const std::exception& error) {
    spdlog::error("{}: {}", channel, error.what());
  }
}

}  // namespace layfigure::messaging
