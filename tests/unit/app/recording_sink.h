#pragma once

#include <vector>

#include "layfigure/app/message_sink.h"
#include "layfigure/messaging/codec.h"

namespace layfigure::app {

/// Keeps what is published.
struct RecordingSink : MessageSink {
  void publish(const pose_t& message) override { poses.push_back(message); }
  void publish(const force_t& message) override { forces.push_back(message); }
  void publish(const character_t& message) override { characters.push_back(message); }
  void publish(const mesh_chunk_t& message) override { chunks.push_back(message); }
  void publish(const reply_t& message) override { replies.push_back(message); }
  void publish(const status_t& message) override { statuses.push_back(message); }

  std::vector<pose_t> poses;
  std::vector<force_t> forces;
  std::vector<character_t> characters;
  std::vector<mesh_chunk_t> chunks;
  std::vector<reply_t> replies;
  std::vector<status_t> statuses;
};

}  // namespace layfigure::app
