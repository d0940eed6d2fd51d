#pragma once

#include <cstdint>
#include <layfigure/mesh_chunk_t.hpp>

#include "layfigure/character/rig.h"
#include "layfigure/messaging/codec.h"

namespace layfigure::app {

/// The character's meshes as one encoded meshes_t, cut into pieces of at most messaging::kMeshChunkBytes.
class MeshChunks {
 public:
  explicit MeshChunks(const character::Rig& rig);

  /// Size of the whole [bytes].
  [[nodiscard]] std::int32_t bytes() const { return static_cast<std::int32_t>(bytes_.size()); }
  [[nodiscard]] std::int32_t total() const;
  /// Piece `index` of total(), without time stamp and server_id.
  [[nodiscard]] mesh_chunk_t chunk(std::int32_t index) const;

 private:
  std::int64_t content_hash_;
  messaging::Bytes bytes_;
};

}  // namespace layfigure::app
