#pragma once

#include <cstdint>
#include <layfigure/character_t.hpp>
#include <layfigure/command_t.hpp>
#include <layfigure/force_t.hpp>
#include <layfigure/log_devices_t.hpp>
#include <layfigure/log_snapshot_t.hpp>
#include <layfigure/log_start_t.hpp>
#include <layfigure/log_step_t.hpp>
#include <layfigure/mesh_chunk_t.hpp>
#include <layfigure/meshes_t.hpp>
#include <layfigure/pointer_t.hpp>
#include <layfigure/pose_t.hpp>
#include <layfigure/reply_t.hpp>
#include <layfigure/spidar_command_t.hpp>
#include <layfigure/spidar_state_t.hpp>
#include <layfigure/status_t.hpp>

/// One message of each type with every field set, to a value that no other field has where that is possible.
namespace layfigure::testing {

[[nodiscard]] character_t sample_character();
[[nodiscard]] command_t sample_command();
[[nodiscard]] force_t sample_force();
[[nodiscard]] log_devices_t sample_log_devices();
[[nodiscard]] log_snapshot_t sample_log_snapshot();
[[nodiscard]] log_start_t sample_log_start();
[[nodiscard]] log_step_t sample_log_step();
[[nodiscard]] mesh_chunk_t sample_mesh_chunk();
[[nodiscard]] meshes_t sample_meshes();
[[nodiscard]] pointer_t sample_pointer();
[[nodiscard]] pose_t sample_pose();
[[nodiscard]] reply_t sample_reply();
[[nodiscard]] spidar_command_t sample_spidar_command();
[[nodiscard]] spidar_state_t sample_spidar_state();
[[nodiscard]] status_t sample_status();

/// A command with one argument.
[[nodiscard]] command_t make_command(std::int64_t sequence, const std::string& name);
[[nodiscard]] argument_t text_argument(const std::string& name, const std::string& text);
[[nodiscard]] argument_t number_argument(const std::string& name, std::vector<double> values);
void add_argument(command_t& command, argument_t argument);

}  // namespace layfigure::testing
