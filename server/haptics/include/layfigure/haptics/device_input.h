#pragma once

#include <cstdint>
#include <vector>

#include "layfigure/haptics/haptic_loop.h"
#include "layfigure/haptics/local_model.h"
#include "layfigure/haptics/pointer_pose.h"

namespace layfigure::haptics {

/// What haptic devices brought into one step of the doll. Beside commands and messages it is all of the world outside
/// that the step depends on: a step with the same input is the same step, bit for bit, whether there is a device or
/// not.
struct DeviceInput {
  struct Hand {
    std::uint32_t buttons{0};  ///< before the step, see device::Reading
    double grip{0.0};          ///< so too
    bool has_hand{false};
    PointerPose hand;  ///< in the step; in the device's frame
  };

  std::vector<Hand> hands;  ///< one per device
  bool arrived{false};      ///< else the pointers stay where they are, and loads act on as they did
  // of devices that are served between steps, see HapticReport
  std::vector<PortLoad> loads;
  std::vector<ServedTool> tools;  ///< kMostPointers, or none
};

}  // namespace layfigure::haptics
