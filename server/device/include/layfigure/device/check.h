#pragma once

#include <functional>
#include <memory>
#include <string>

#include "layfigure/device/device.h"

namespace layfigure::device {

/// One thing that was looked at.
struct CheckLine {
  enum class Result { kPassed, kFailed, kTold };  ///< told: a figure that nothing depends on
  Result result;
  std::string what;  ///< "poses are finite"
  std::string detail;
};

struct CheckSettings {
  double seconds{2.0};  ///< of reading, and of the time that a device which is not there yet is waited for, > 0
  double tick{1e-3};    ///< of the caller [s], > 0
};

/// Whether a device keeps to what the server relies on: it answers at once, its poses are finite, new ones come often
/// enough for the forces that it claims, quaternions are unit, nothing jumps, it lives through wrenches that are not
/// finite or too large and exerts no more than it says, lets go when told to and when closed, and opens again.
///
/// Drives it with forces: nobody's hand should be at it. A simulated device is driven by its own time, all others by
/// the wall clock; times of calls are judged by their medians, so that a busy machine does not fail a device. Every
/// line is given to `tell` as soon as it is known. Returns whether none failed.
bool check_device(const std::function<std::unique_ptr<Driver>()>& open, const CheckSettings& settings,
                  const std::function<void(const CheckLine&)>& tell);

}  // namespace layfigure::device
