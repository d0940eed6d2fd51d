#include "sample_messages.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace layfigure::testing {
namespace {

constexpr std::int64_t kTime = 1234567;
constexpr std::int64_t kServer = 0x0123456789abcdef;
constexpr std::int64_t kHash = -81985529216486896;

template <class Message>
Message begin_message() {
  Message message{};
  message.protocol_version = 1;
  message.time_us = kTime;
  return message;
}

template <std::size_t N>
void fill(double (&out)[N], double first) {
  for (double& value : out) value = std::exchange(first, first + 0.125);
}

joint_t sample_joint(int index) {
  joint_t joint{};
  joint.name = index == 0 ? "hips" : "H\u00fcfte.L";
  joint.parent = index - 1;
  fill(joint.rest_translation, 1.0 + index);
  fill(joint.rest_rotation, 11.0 + index);
  fill(joint.bind_translation, 21.0 + index);
  fill(joint.bind_rotation, 31.0 + index);
  joint.is_body = index == 0;
  joint.mass = 0.25;
  joint.stiffness = 40.5;
  joint.yield_torque = index == 0 ? std::numeric_limits<double>::infinity() : 2.5;
  return joint;
}

mesh_t sample_mesh() {
  mesh_t mesh{};
  mesh.name = "skin";
  mesh.material = 0;
  mesh.vertex_count = 3;
  mesh.points = {{0.0F, 0.25F, 0.5F}, {1.0F, 1.25F, 1.5F}, {2.0F, 2.25F, 2.5F}};
  mesh.triangle_count = 1;
  mesh.triangles = {{0, 1, 2}};
  mesh.influence_count = 2;
  mesh.joint_indices = {{0, 1}, {1, 0}, {0, 0}};
  mesh.joint_weights = {{0.75F, 0.25F}, {0.5F, 0.5F}, {1.0F, 0.0F}};
  mesh.normals = {{0.0F, 0.0F, 1.0F}, {0.0F, 1.0F, 0.0F}, {1.0F, 0.0F, 0.0F}, {0.0F, -1.0F, 0.0F}};
  mesh.normal_count = 4;
  mesh.uvs = {{0.0F, 0.125F}, {0.25F, 0.375F}, {0.5F, 0.625F}, {0.75F, 0.875F}};
  mesh.uv_count = 4;
  mesh.wedge_triangle_count = 1;
  mesh.wedge_triangles = {{3, 1, 2}};
  return mesh;
}

material_t sample_material() {
  material_t material{};
  material.name = "H\u00e4ut";
  fill(material.base_color, 0.5);
  material.opacity = 0.75;
  material.texture_alpha = true;
  material.alpha_cutoff = 0.25;
  material.texture = "textures/skin.png";
  material.image = -1;
  material.wrap_u = "clamp";
  material.wrap_v = "mirror";
  return material;
}

image_t sample_image() {
  image_t image{};
  image.name = "eye";
  image.format = "png";
  image.bytes = {137, 80, 78, 71};
  image.byte_count = 4;
  return image;
}

}  // namespace

character_t sample_character() {
  auto message = begin_message<character_t>();
  message.server_id = kServer;
  message.name = "doll";
  message.source_file = "doll.glb";
  message.source_folder = "/home/me/characters";
  message.content_hash = kHash;
  message.physics_hz = 1000.0;
  message.pose_hz = 60.0;
  message.clock = "lockstep";
  message.mesh_bytes = 123456;
  message.joints = {sample_joint(0), sample_joint(1)};
  message.joint_count = 2;
  return message;
}

command_t sample_command() {
  auto message = begin_message<command_t>();
  message.client_id = "client-1";
  message.sequence = 7;
  message.name = "grab";
  add_argument(message, text_argument("bone", "H\u00fcfte.L"));
  add_argument(message, number_argument("point", {0.5, -0.25, 1e-3}));
  return message;
}

force_t sample_force() {
  auto message = begin_message<force_t>();
  message.server_id = kServer;
  message.sequence = 42;
  message.pointer = 1;
  message.tool = "touch";
  message.attached = true;
  message.contact = true;
  message.joint = 3;
  fill(message.position, 1.0);
  fill(message.target, 2.0);
  fill(message.force, -3.0);
  fill(message.torque, 4.0);
  fill(message.hand_force, 5.0);
  fill(message.hand_torque, -6.0);
  return message;
}

mesh_chunk_t sample_mesh_chunk() {
  auto message = begin_message<mesh_chunk_t>();
  message.server_id = kServer;
  message.content_hash = kHash;
  message.index = 2;
  message.total = 5;
  message.bytes = {0, 1, 127, 128, 255};
  message.byte_count = static_cast<std::int32_t>(message.bytes.size());
  return message;
}

meshes_t sample_meshes() {
  meshes_t meshes{};
  meshes.content_hash = kHash;
  meshes.mesh_count = 1;
  meshes.meshes = {sample_mesh()};
  meshes.material_count = 1;
  meshes.materials = {sample_material()};
  meshes.image_count = 1;
  meshes.images = {sample_image()};
  return meshes;
}

pointer_t sample_pointer() {
  auto message = begin_message<pointer_t>();
  message.client_id = "client-1";
  message.sequence = 8;
  message.pointer = 1;
  fill(message.position, -0.5);
  std::ranges::copy(std::initializer_list<double>{0.5, -0.5, 0.5, 0.5}, message.rotation);
  return message;
}

pose_t sample_pose() {
  auto message = begin_message<pose_t>();
  message.server_id = kServer;
  message.content_hash = kHash;
  message.sequence = 42;
  message.step = 701;
  fill(message.root_translation, 0.5);
  message.joint_count = 2;
  message.rotations = {{1.0, 0.0, 0.0, 0.0}, {0.5, 0.5, -0.5, 0.5}};
  message.rest_rotations = {{0.0, 1.0, 0.0, 0.0}, {0.0, 0.0, 1.0, 0.0}};
  message.torques = {{0.0F, 0.125F, 0.25F}, {-1.5F, 2.5F, -3.5F}};
  message.yielded = {0, 1};
  return message;
}

log_devices_t sample_log_devices() {
  auto message = begin_message<log_devices_t>();
  message.step = 700;
  message.bytes = {3, 130, 253};
  message.byte_count = 3;
  return message;
}

log_snapshot_t sample_log_snapshot() {
  auto message = begin_message<log_snapshot_t>();
  message.name = "standing";
  message.bytes = {1, 128, 255};
  message.byte_count = 3;
  return message;
}

log_start_t sample_log_start() {
  auto message = begin_message<log_start_t>();
  message.server_id = kServer;
  message.program = "layfigure-server 0.1.0";
  message.character = "/characters/doll.glb";
  message.content_hash = 11;
  message.doll_hash = "0123456789abcdef";
  message.physics_hz = 1000.0;
  message.pose_hz = 60.0;
  message.clock = "realtime";
  message.devices = {"spidar-g6", "lcm"};
  message.device_count = 2;
  message.haptic_ticks = 4;
  message.infos = {4, 131, 252};
  message.info_bytes = 3;
  message.settings = {2, 129, 254};
  message.settings_bytes = 3;
  return message;
}

log_step_t sample_log_step() {
  auto message = begin_message<log_step_t>();
  message.step = 701;
  message.failed = true;
  return message;
}

reply_t sample_reply() {
  auto message = begin_message<reply_t>();
  message.server_id = kServer;
  message.client_id = "client-1";
  message.sequence = 7;
  message.accepted = false;
  message.reason = "no bone is called 'tail'";
  message.results = {number_argument("steps", {3.0}), text_argument("note", "text")};
  message.result_count = 2;
  return message;
}

spidar_command_t sample_spidar_command() {
  auto message = begin_message<spidar_command_t>();
  message.device_id = "left";
  message.sequence = 9;
  message.state_sequence = 10;
  message.active = true;
  message.kind = 1;
  fill(message.tensions, 1.0);
  fill(message.force, -2.0);
  fill(message.torque, 3.0);
  return message;
}

spidar_state_t sample_spidar_state() {
  auto message = begin_message<spidar_state_t>();
  message.device_id = "left";
  message.sequence = 10;
  message.kind = 1;
  fill(message.lengths, 0.25);
  fill(message.position, -0.5);
  std::ranges::copy(std::initializer_list<double>{0.5, -0.5, 0.5, 0.5}, message.rotation);
  message.grip = 0.75;
  message.buttons = 5;
  return message;
}

status_t sample_status() {
  auto message = begin_message<status_t>();
  message.server_id = kServer;
  message.state = "failed";
  message.detail = "step 12 would not be finite; reset to go on";
  message.clock = "realtime";
  message.content_hash = kHash;
  message.steps = 11;
  message.poses = 3;
  message.late_steps = 2;
  message.dropped_time = 1.5;
  message.step_us_p50 = 4.5;
  message.step_us_p99 = 9.5;
  message.step_us_max = 20.5;
  message.realtime_factor = 100.25;
  message.yielding_joints = 1;
  message.kinetic_energy = 0.125;
  message.elastic_energy = 0.375;
  message.bad_messages = 5;
  device_t device{};
  device.name = "SPIDAR-G6X3 (simulated)";
  device.pointer = 1;
  device.state = "silent";
  device.last_fault = "silent";
  device.faults = 2;
  device.share = 0.25;
  device.reach = 0.5;
  device.turn = 0.75;
  device.energy = 0.125;
  device.haptic_hz = 4000.0;
  device.haptic_rate = 3999.5;
  device.late_ticks = 3;
  device.tick_us_p50 = 8.0;
  device.tick_us_p99 = 16.0;
  device.tick_us_max = 64.0;
  device.realtime = 1;
  message.devices = {device};
  message.device_count = 1;
  message.dropped_messages = 6;
  message.paused_clients = 7;
  message.clients = 8;
  message.max_clients = 9;
  message.max_message_bytes = 10;
  message.max_message_rate = 200.5;
  return message;
}

command_t make_command(std::int64_t sequence, const std::string& name) {
  command_t command{};
  command.protocol_version = 1;
  command.client_id = "test";
  command.sequence = sequence;
  command.name = name;
  return command;
}

argument_t text_argument(const std::string& name, const std::string& text) {
  argument_t argument{};
  argument.name = name;
  argument.text = text;
  return argument;
}

argument_t number_argument(const std::string& name, std::vector<double> values) {
  argument_t argument{};
  argument.name = name;
  argument.value_count = static_cast<std::int32_t>(values.size());
  argument.values = std::move(values);
  return argument;
}

void add_argument(command_t& command, argument_t argument) {
  command.arguments.push_back(std::move(argument));
  command.argument_count = static_cast<std::int32_t>(command.arguments.size());
}

}  // namespace layfigure::testing
