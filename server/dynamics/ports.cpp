#include "layfigure/dynamics/ports.h"

#include "lane_transfer.h"
#include "path_tree.h"
#include "port_factors.h"
#include "workspace.h"

namespace layfigure::dynamics {
namespace {

using Kind = ConstraintBlock::Kind;

// A row whose pivot falls below this part of what it began with depends on those before it.
constexpr double kDependent = 1e-10;
// Impulses this near to a bound are at it.
constexpr double kAtBound = 1.0 - 1e-9;

/// A port in the step's own terms: on the body that carries its own.
struct CarriedPort {
  int carrier;
  Eigen::Vector3d point;  ///< in the carrier's frame
};

CarriedPort carried(const RigidGroups& groups, const Port& port) {
  if (!groups.rides(port.body)) return {.carrier = port.body, .point = port.point};
  const Rider& rider = groups.rider(port.body);
  return {.carrier = rider.carrier, .point = rider.origin + rider.rotation * port.point};
}

struct Frame {
  Eigen::Quaterniond rotation;
  Eigen::Vector3d origin;
};

Frame frame_of(const Model& model, const State& state, int body) {
  const BodyState& own = state.bodies[body];
  const int parent = model.body(body).parent;
  if (parent < 0) return {.rotation = own.rotation, .origin = own.position};
  const Frame base = frame_of(model, state, parent);
  return {.rotation = base.rotation * own.rotation, .origin = base.origin + base.rotation * own.position};
}

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& r) {
  Eigen::Matrix3d m;
  m << 0.0, -r.z(), r.y(), r.z(), 0.0, -r.x(), -r.y(), r.x(), 0.0;
  return m;
}

/// How many of a block's rows, from the first on, are constraints as they act.
int acting_rows(const ConstraintBlock& block) {
  if (block.impulse.isZero(0.0)) return 0;
  if (block.kind != Kind::kContact || block.rows == 1) return block.rows;
  const double most = block.laws[0].friction * block.impulse[0] * kAtBound;
  return block.impulse.tail<2>().norm() < most ? 3 : 1;
}

bool at_bound(const ConstraintBlock& block, int row) {
  const LcpRow& law = block.laws[row];
  if (law.kind != LcpRowKind::kBox || block.kind == Kind::kLimit) return false;
  const double impulse = block.impulse[row];
  return impulse >= law.upper * kAtBound || impulse <= law.lower * kAtBound;
}

}  // namespace

struct PortResponse::Data {
  explicit Data(const Model& model) { tree.reserve(model.size()); }

  void read_ports(const Model& model, const State& before, const RigidGroups& groups, std::span<const Port> list);
  void read_rows(const ConstraintSet& set);
  template <class T>
  void touch(const State& before, const Plan<T>& plan, const std::vector<Node<T>>& nodes);
  template <class T>
  void read_velocities(const Plan<T>& plan, const std::vector<Node<T>>& nodes, double length);
  void assemble(Eigen::MatrixXd& result);
  template <class T>
  void measure(const State& before, const Plan<T>& plan, std::vector<Node<T>>& nodes, double length);

  PathTree tree;
  std::vector<CarriedPort> ports;
  std::vector<Eigen::Vector3d> levers;  ///< from the carriers' origins to the points, world
  std::vector<Eigen::Quaterniond> rotations;
  std::vector<Eigen::Vector3d> positions;
  struct Row {
    const ConstraintBlock* block;
    int count;
  };
  std::vector<Row> rows;
  int row_count{0};
  std::vector<char> passed_over;  ///< of each row
  Eigen::VectorXd first_pivots;
  Eigen::MatrixXd step, damped, inertial;
  Eigen::VectorXd velocity, acceleration;
  double factor_length{0.0};
};

void PortResponse::Data::read_ports(const Model& model, const State& before, const RigidGroups& groups,
                                    std::span<const Port> list) {
  ports.clear();
  levers.clear();
  rotations.clear();
  positions.clear();
  const auto size = static_cast<Eigen::Index>(6 * list.size());
  velocity.setZero(size);
  acceleration.setZero(size);
  const bool described = groups.describes(before);
  for (std::size_t k = 0; k < list.size(); ++k) {
    ports.push_back(carried(groups, list[k]));
    const Frame frame = frame_of(model, before, list[k].body);
    rotations.push_back(frame.rotation);
    positions.push_back(frame.origin + frame.rotation * list[k].point);
    // What has been woken by the step was as good as at rest.
    if (!described) continue;
    const int carrier = ports.back().carrier;
    const GroupMotion motion = groups.motion(before.bodies.data(), carrier);
    const Eigen::Vector3d way = motion.orientation * (ports.back().point - groups.group(carrier).com);
    velocity.segment<3>(6 * k) = motion.spin;
    velocity.segment<3>(6 * k + 3) = motion.velocity + motion.spin.cross(way);
  }
}

void PortResponse::Data::read_rows(const ConstraintSet& set) {
  rows.clear();
  passed_over.clear();
  row_count = 0;
  for (const ConstraintBlock& block : set.blocks()) {
    const int count = acting_rows(block);
    if (count == 0) continue;
    rows.push_back({.block = &block, .count = count});
    row_count += count;
    for (int k = 0; k < count; ++k) passed_over.push_back(at_bound(block, k) ? 1 : 0);
  }
}

/// Reads the paths out of the factors.
template <class T>
void PortResponse::Data::touch(const State& before, const Plan<T>& plan, const std::vector<Node<T>>& nodes) {
  tree.clear();
  Copy copy;
  copy.from = before.bodies.data();
  const StepContext context{.model = nullptr,
                            .law = {},
                            .gravity = {},
                            .time = 0.0,
                            .inputs = nullptr,
                            .copies = {&copy, 1},
                            .minds_energy = false};
  for (const Row& row : rows) {
    const Jacobian& jacobian = row.block->jacobian;
    for (const int body : {jacobian.a.body, jacobian.b.body, jacobian.joint}) {
      tree.touch(context, plan, nodes, 0, body);
    }
  }
  for (const CarriedPort& port : ports) tree.touch(context, plan, nodes, 0, port.carrier);
}

template <class T>
void PortResponse::Data::read_velocities(const Plan<T>& plan, const std::vector<Node<T>>& nodes, double length) {
  for (std::size_t k = 0; k < ports.size(); ++k) {
    const int carrier = ports[k].carrier;
    const Node<T>& node = nodes[plan.schedule.slot_of(0, carrier)];
    const int lane = plan.schedule.lane_of(0, carrier);
    const Eigen::Vector3d spin = math::lane(node.w_WB, lane);
    const Eigen::Vector3d lever = tree.at(carrier).rotation * ports[k].point;
    levers.push_back(lever);
    acceleration.segment<3>(6 * k) = spin;
    acceleration.segment<3>(6 * k + 3) = math::lane(node.v_WB, lane) + spin.cross(lever);
  }
  acceleration = (acceleration - velocity) / length;
}

/// The Delassus matrix of the rows and the ports, the rows eliminated.
void PortResponse::Data::assemble(Eigen::MatrixXd& result) {
  const int port_rows = static_cast<int>(6 * ports.size());
  tree.begin(row_count + port_rows);
  int first = 0;
  for (const Row& row : rows) {
    tree.add(row.block->jacobian, first, row.count);
    first += row.count;
  }
  for (std::size_t k = 0; k < ports.size(); ++k, first += 6) {
    Jacobian jacobian;
    jacobian.a.body = ports[k].carrier;
    jacobian.a.moment.setIdentity();
    tree.add(jacobian, first, 3);
    jacobian.a.moment = cross_matrix(levers[k]);
    jacobian.a.force.setIdentity();
    tree.add(jacobian, first + 3, 3);
  }
  Eigen::Map<Eigen::MatrixXd> all = tree.matrix();
  for (int row = 0; const Row& entry : rows) {
    for (int k = 0; k < entry.count; ++k, ++row) all(row, row) += entry.block->compliance[k];
  }
  first_pivots = all.diagonal().head(row_count);
  const int size = row_count + port_rows;
  for (int k = 0; k < row_count; ++k) {
    if (passed_over[k] != 0) continue;
    // What has been eliminated before has lessened the pivot.
    const double pivot = all(k, k);
    if (!(pivot > kDependent * first_pivots[k])) continue;
    for (int j = k + 1; j < size; ++j) {
      const double share = all(j, k) / pivot;
      if (share != 0.0) all.col(j).tail(size - j) -= share * all.col(k).tail(size - j);
    }
  }
  result = all.bottomRightCorner(port_rows, port_rows).selfadjointView<Eigen::Lower>();
}

template <class T>
void PortResponse::Data::measure(const State& before, const Plan<T>& plan, std::vector<Node<T>>& nodes, double length) {
  touch(before, plan, nodes);
  tree.read_factors(plan, nodes);
  read_velocities(plan, nodes, length);
  assemble(step);
  eliminate_with(GainPart::kDamping, plan, nodes);
  tree.renew();
  tree.read_factors(plan, nodes);
  assemble(damped);
  eliminate_with(GainPart::kNone, plan, nodes);
  tree.renew();
  tree.read_factors(plan, nodes);
  assemble(inertial);
}

PortResponse::PortResponse(const Model& model) : data_(std::make_unique<Data>(model)) {}
PortResponse::~PortResponse() = default;
PortResponse::PortResponse(PortResponse&&) noexcept = default;
PortResponse& PortResponse::operator=(PortResponse&&) noexcept = default;

bool PortResponse::measure(const Model& model, const State& before, Workspace& workspace, double step_length,
                           std::span<const Port> ports) {
  Workspace::Data& source = workspace.data();
  if (source.factored_version != source.groups.version()) return false;
  source.factored_version = Workspace::Data::kNoFactors;
  Data& data = *data_;
  data.factor_length = source.copies[source.finest].h;
  data.read_ports(model, before, source.groups, ports);
  data.read_rows(source.constraints[source.finest]);
  if (source.goes_narrow) {
    data.measure(before, source.narrow, source.scratch[0].narrow, step_length);
  } else {
    data.measure(before, source.plans[0], source.scratch[0].wide, step_length);
  }
  return true;
}

int PortResponse::ports() const { return static_cast<int>(data_->ports.size()); }
const Eigen::MatrixXd& PortResponse::matrix() const { return data_->step; }
const Eigen::MatrixXd& PortResponse::damped_matrix() const { return data_->damped; }
const Eigen::MatrixXd& PortResponse::inertial_matrix() const { return data_->inertial; }
double PortResponse::factor_length() const { return data_->factor_length; }
const Eigen::Quaterniond& PortResponse::rotation(int k) const { return data_->rotations[k]; }
const Eigen::Vector3d& PortResponse::position(int k) const { return data_->positions[k]; }
const Eigen::VectorXd& PortResponse::velocity() const { return data_->velocity; }
const Eigen::VectorXd& PortResponse::acceleration() const { return data_->acceleration; }

}  // namespace layfigure::dynamics
