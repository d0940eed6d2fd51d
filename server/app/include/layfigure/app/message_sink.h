#pragma once

#include <layfigure/character_t.hpp>
#include <layfigure/force_t.hpp>
#include <layfigure/mesh_chunk_t.hpp>
#include <layfigure/pose_t.hpp>
#include <layfigure/reply_t.hpp>
#include <layfigure/status_t.hpp>

namespace layfigure::app {

/// Where messages go: the bus, or a test that looks at them. Must not block.
class MessageSink {
 public:
  virtual ~MessageSink() = default;
  virtual void publish(const pose_t& message) = 0;
  virtual void publish(const force_t& message) = 0;
  virtual void publish(const character_t& message) = 0;
  virtual void publish(const mesh_chunk_t& message) = 0;
  virtual void publish(const reply_t& message) = 0;
  virtual void publish(const status_t& message) = 0;
};

}  // namespace layfigure::app
