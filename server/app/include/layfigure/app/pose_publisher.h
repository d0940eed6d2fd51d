#pragma once

#include <cstdint>
#include <optional>

#include "layfigure/app/message_sink.h"
#include "layfigure/app/simulation.h"

namespace layfigure::app {

/// Publishes a simulation's poses, each with the forces of all pointers, at pose_hz of simulation time: for k = 0, 1,
/// .. one after the first step n with n / physics_hz >= k / pose_hz. The time stamp is that step's exact time.
class PosePublisher {
 public:
  PosePublisher(const Simulation& simulation, MessageSink& sink, std::int64_t server_id);

  /// To be called at the start and after each step.
  void publish_if_due();
  /// Out of turn, unless the newest pose is of this step: while the doll rests, and when that ends.
  void publish();
  /// Sends the newest pose once more, same sequence number: for a client that has just come, while time may stand
  /// still.
  void repeat_newest();
  /// Poses published, without repetitions.
  [[nodiscard]] std::int64_t count() const { return count_; }

 private:
  [[nodiscard]] bool is_due() const;

  const Simulation& simulation_;
  MessageSink& sink_;
  std::int64_t server_id_;
  std::int64_t count_{0};
  std::int64_t next_{0};  ///< k of the next pose that is due
  std::optional<pose_t> newest_;
  doll::SkeletonPose skeleton_;
};

}  // namespace layfigure::app
