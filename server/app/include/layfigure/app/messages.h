#pragma once

#include <cstdint>
#include <layfigure/character_t.hpp>
#include <layfigure/force_t.hpp>
#include <layfigure/pointer_t.hpp>
#include <layfigure/pose_t.hpp>
#include <layfigure/status_t.hpp>
#include <string>
#include <string_view>

#include "layfigure/app/simulation.h"
#include "layfigure/doll/doll.h"

namespace layfigure::app {

/// "realtime" or "lockstep"
[[nodiscard]] std::string clock_name(ClockKind clock);

/// character_t.content_hash: the rig's hash in LCM's signed type.
[[nodiscard]] std::int64_t content_hash(const doll::Doll& doll);

/// Gives the simulation what a client says of a pointer.
void point(const pointer_t& message, Simulation& simulation);

/// The skeleton. `mesh_bytes` is the size of the encoded meshes_t.
[[nodiscard]] character_t make_character(const Simulation& simulation, std::int64_t server_id, std::int32_t mesh_bytes);

/// The present pose. `skeleton` is scratch memory.
[[nodiscard]] pose_t make_pose(const Simulation& simulation, std::int64_t server_id, std::int64_t sequence,
                               doll::SkeletonPose& skeleton);

/// What pointer `id` exerts, and what its hand is to feel. `sequence` is that of the pose it belongs to.
[[nodiscard]] force_t make_force(const Simulation& simulation, std::int64_t server_id, std::int64_t sequence, int id,
                                 const Pointer& pointer);

/// The simulation's part of a heartbeat; the counters of clock and bus are left 0.
[[nodiscard]] status_t make_status(const Simulation& simulation, std::int64_t server_id);

}  // namespace layfigure::app
