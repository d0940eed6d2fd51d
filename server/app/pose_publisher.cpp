#include "layfigure/app/pose_publisher.h"

#include "layfigure/app/messages.h"

namespace layfigure::app {

PosePublisher::PosePublisher(const Simulation& simulation, MessageSink& sink, std::int64_t server_id)
    : simulation_(simulation), sink_(sink), server_id_(server_id) {}

/// n / physics_hz >= k / pose_hz, without a division: exact for whole rates.
bool PosePublisher::is_due() const {
  const SimulationSettings& settings = simulation_.settings();
  return static_cast<double>(simulation_.steps()) * settings.pose_hz >=
         static_cast<double>(next_) * settings.physics_hz;
}

void PosePublisher::publish_if_due() {
  if (is_due()) publish();
}

void PosePublisher::publish() {
  while (is_due()) ++next_;
  if (newest_ && newest_->step == simulation_.steps()) return;
  newest_ = make_pose(simulation_, server_id_, count_, skeleton_);
  sink_.publish(*newest_);
  for (const auto& [id, pointer] : simulation_.pointers()) {
    sink_.publish(make_force(simulation_, server_id_, count_, id, pointer));
  }
  ++count_;
}

void PosePublisher::repeat_newest() {
  if (newest_) sink_.publish(*newest_);
}

}  // namespace layfigure::app
