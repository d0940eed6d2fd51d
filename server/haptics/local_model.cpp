#include "layfigure/haptics/local_model.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

namespace layfigure::haptics {
namespace {

using dynamics::Contact;
using dynamics::kWorld;
using dynamics::Port;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Where a port cannot move at all A has no inverse: this part of the masses' compliance is added to all three, so that
// what is rigid is as stiff as the doll's mass over a thousandth of the step.
constexpr double kLeastCompliance = 1e-6;

Matrix3d cross_matrix(const Vector3d& r) {
  Matrix3d m;
  m << 0.0, -r.z(), r.y(), r.z(), 0.0, -r.x(), -r.y(), r.x(), 0.0;
  return m;
}

std::array<double, 3> stored(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

template <std::size_t kSize>
void store(const MatrixXd& matrix, std::array<double, kSize>& place) {
  std::copy_n(matrix.data(), matrix.size(), place.begin());
}

}  // namespace

void PortLoads::set(const dynamics::Model& model, const dynamics::State& state, std::span<const PortLoad> loads) {
  count_ = static_cast<int>(std::min<std::size_t>(loads.size(), kMostPorts));
  for (int k = 0; k < count_; ++k) {
    const auto& [pointer, port, wrench] = loads[k];
    Eigen::Quaterniond rotation = state.bodies[port.body].rotation;
    for (int i = model.body(port.body).parent; i >= 0; i = model.body(i).parent) {
      rotation = state.bodies[i].rotation * rotation;
    }
    const Vector3d lever = rotation * (port.point - model.body(port.body).com);
    loads_[k] = {.body = port.body,
                 .force = {.force = wrench.force, .torque = wrench.torque + lever.cross(wrench.force)}};
  }
}

void PortLoads::add(double /*time*/, std::span<dynamics::BodyForce> forces) const {
  for (int k = 0; k < count_; ++k) {
    forces[loads_[k].body].force += loads_[k].force.force;
    forces[loads_[k].body].torque += loads_[k].force.torque;
  }
}

void put_body(const dynamics::Model& model, int body, const Eigen::Quaterniond& rotation, const Vector3d& position,
              const dynamics::BodyVelocity& velocity, dynamics::State& state) {
  const dynamics::BodyDefinition& definition = model.body(body);
  dynamics::BodyState& target = state.bodies[body];
  const Matrix3d R = rotation.toRotationMatrix();
  target.rotation = rotation;
  target.position = position;
  target.linear_momentum = definition.mass * velocity.linear;
  target.angular_momentum = R * definition.inertia * R.transpose() * velocity.angular;
}

struct LocalModeler::Data {
  explicit Data(const dynamics::Model& m) : model(m), response(m) {}

  void choose(const TrialStep& trial, std::span<const PointerPort> pointers, LocalModel& result);
  void order_contacts(const TrialStep& trial);
  [[nodiscard]] int port_of(int body) const;
  void place_ports(std::span<const PointerPort> pointers, LocalModel& result) const;
  void place_contacts(const TrialStep& trial, LocalModel& result);
  void find_inverses();
  void find_drift(const TrialStep& trial, LocalModel& result);
  void find_response(LocalModel& result);
  void find_contact_response(LocalModel& result);

  const dynamics::Model& model;
  dynamics::PortResponse response;
  std::vector<Port> ports;
  std::vector<int> order;  ///< of the trial's contacts
  std::vector<int> local;  ///< those that the ticks solve
  std::vector<double> gaps;
  std::vector<dynamics::BodyPose> poses;
  Eigen::LLT<MatrixXd> cholesky;
  MatrixXd inertial, damped, whole;  ///< A_M^-1, A_D^-1, A^-1
  MatrixXd compliant, damping, spring, implicit, inverse;
  VectorXd drift;
  MatrixXd jacobian, transposed, contact_response, delassus;
};

int LocalModeler::Data::port_of(int body) const {
  for (std::size_t k = 0; k < ports.size(); ++k) {
    if (ports[k].body == body) return static_cast<int>(k);
  }
  return -1;
}

/// As they come; where there are too many, the nearest first.
void LocalModeler::Data::order_contacts(const TrialStep& trial) {
  order.resize(trial.contacts.size());
  std::iota(order.begin(), order.end(), 0);
  if (order.size() <= kMostContacts) return;
  dynamics::world_poses(model, trial.before, poses);
  const auto place = [&](int body, const Vector3d& point) -> Vector3d {
    return body == kWorld ? point : poses[body].origin + poses[body].rotation * point;
  };
  gaps.clear();
  for (const Contact& contact : trial.contacts) {
    gaps.push_back(contact.normal.dot(place(contact.body_a, contact.point_a) - place(contact.body_b, contact.point_b)));
  }
  std::sort(order.begin(), order.end(), [this](int a, int b) { return std::pair(gaps[a], a) < std::pair(gaps[b], b); });
}

/// The ports, and which contacts are between them.
void LocalModeler::Data::choose(const TrialStep& trial, std::span<const PointerPort> pointers, LocalModel& result) {
  ports.clear();
  local.clear();
  result.left_out = 0;
  result.own.fill(false);
  const auto add = [&](const Port& port) {
    if (port_of(port.body) < 0 && ports.size() < kMostPorts) ports.push_back(port);
    return port_of(port.body) >= 0;
  };
  for (const PointerPort& pointer : pointers) {
    result.own[ports.size()] = pointer.touches;
    ports.push_back(pointer.port);
  }
  // What is loaded is a port even where nothing is near to it any more: the loads are taken out of the drift.
  for (const PortLoad& load : trial.loads) (void)add(load.port);
  order_contacts(trial);
  for (const int i : order) {
    const Contact& contact = trial.contacts[i];
    bool fits = local.size() < kMostContacts;
    for (const int body : {contact.body_a, contact.body_b}) {
      if (body != kWorld) fits = fits && add({.body = body, .point = model.body(body).com});
    }
    if (fits) {
      local.push_back(i);
    } else {
      ++result.left_out;
    }
  }
  result.pointers = static_cast<int>(pointers.size());
  result.ports = static_cast<int>(ports.size());
  result.contacts = static_cast<int>(local.size());
}

void LocalModeler::Data::place_ports(std::span<const PointerPort> pointers, LocalModel& result) const {
  for (int k = 0; k < result.ports; ++k) {
    result.body[k] = ports[k].body;
    const bool held = k < result.pointers;
    if (held) {
      result.gains[k] = pointers[k].gains;
      result.pointer[k] = pointers[k].pointer;
    }
    const Eigen::Quaterniond frame =
        held ? Eigen::Quaterniond(response.rotation(k) * pointers[k].orientation) : response.rotation(k);
    std::copy_n(ports[k].point.data(), 3, result.point.begin() + 3 * k);
    std::copy_n(response.position(k).data(), 3, result.position.begin() + 3 * k);
    std::copy_n(frame.coeffs().data(), 4, result.rotation.begin() + 4 * k);
  }
  std::copy_n(response.velocity().data(), result.rows(), result.velocity.begin());
}

void LocalModeler::Data::place_contacts(const TrialStep& trial, LocalModel& result) {
  const int rows = 3 * result.contacts;
  jacobian.setZero(rows, result.rows());
  for (int i = 0; i < result.contacts; ++i) {
    const Contact& contact = trial.contacts[local[i]];
    const Vector3d t1 = contact.normal.unitOrthogonal();
    Matrix3d directions;
    directions << contact.normal.transpose(), t1.transpose(), contact.normal.cross(t1).transpose();
    LocalContact& place = result.contact[i];
    place = {.port_a = port_of(contact.body_a),
             .port_b = contact.body_b == kWorld ? -1 : port_of(contact.body_b),
             .friction = contact.friction,
             .gap = 0.0,
             .normal = stored(contact.normal),
             .a_to_normal = {},
             .b_to_normal = {}};
    const auto add_side = [&](int port, const Vector3d& point, double sign) -> Vector3d {
      const Vector3d lever = response.rotation(port) * (point - ports[port].point);
      jacobian.block<3, 3>(3 * i, 6 * port) = -sign * directions * cross_matrix(lever);
      jacobian.block<3, 3>(3 * i, 6 * port + 3) = sign * directions;
      return lever;
    };
    const Vector3d a = add_side(place.port_a, contact.point_a, 1.0);
    Vector3d way = response.position(place.port_a) + a;
    place.a_to_normal = stored(a);
    if (place.port_b >= 0) {
      const Vector3d b = add_side(place.port_b, contact.point_b, -1.0);
      place.b_to_normal = stored(b);
      way -= response.position(place.port_b) + b;
    } else {
      way -= contact.point_b;
    }
    place.gap = contact.normal.dot(way);
  }
}

void LocalModeler::Data::find_inverses() {
  const MatrixXd& masses = response.inertial_matrix();
  const Eigen::Index size = masses.rows();
  double angular = 0.0;
  double linear = 0.0;
  for (Eigen::Index k = 0; k < size; k += 6) {
    angular = std::max(angular, masses.diagonal().segment<3>(k).maxCoeff());
    linear = std::max(linear, masses.diagonal().segment<3>(k + 3).maxCoeff());
  }
  const auto invert = [&](const MatrixXd& matrix, MatrixXd& result) {
    compliant = matrix;
    for (Eigen::Index k = 0; k < size; k += 6) {
      compliant.diagonal().segment<3>(k).array() += kLeastCompliance * angular;
      compliant.diagonal().segment<3>(k + 3).array() += kLeastCompliance * linear;
    }
    cholesky.compute(compliant);
    result.setIdentity(size, size);
    cholesky.solveInPlace(result);
    result.triangularView<Eigen::StrictlyUpper>() = result.transpose();
  };
  invert(masses, inertial);
  invert(response.damped_matrix(), damped);
  invert(response.matrix(), whole);
}

/// A^-1 b: what acts without the loads.
void LocalModeler::Data::find_drift(const TrialStep& trial, LocalModel& result) {
  drift.noalias() = whole * response.acceleration();
  for (const auto& [pointer, port, wrench] : trial.loads) {
    for (int k = 0; k < result.ports; ++k) {
      if (ports[k].body != port.body || ports[k].point != port.point) continue;
      drift.segment<3>(6 * k) -= wrench.torque;
      drift.segment<3>(6 * k + 3) -= wrench.force;
      break;
    }
  }
  std::copy_n(drift.data(), drift.size(), result.drift.begin());
}

void LocalModeler::Data::find_response(LocalModel& result) {
  const double H = response.factor_length();
  const double h = result.tick;
  damping = (damped - inertial) / H;
  spring = (whole - damped) / (H * H);
  implicit = inertial + h * damping + h * h * spring;
  for (int k = 0; k < result.pointers; ++k) {
    const CouplingGains& gains = result.gains[k];
    implicit.diagonal().segment<3>(6 * k).array() += h * (h * gains.angular_stiffness + gains.angular_damping);
    implicit.diagonal().segment<3>(6 * k + 3).array() += h * (h * gains.stiffness + gains.damping);
  }
  cholesky.compute(implicit);
  inverse.setIdentity(result.rows(), result.rows());
  cholesky.solveInPlace(inverse);
  store(response.matrix(), result.compliance);
  store(inertial, result.mass);
  store(spring, result.spring);
  store(inverse, result.response);
}

void LocalModeler::Data::find_contact_response(LocalModel& result) {
  transposed = jacobian.transpose();
  contact_response.noalias() = inverse * transposed;
  delassus.noalias() = jacobian * contact_response;
  store(transposed, result.contact_jacobian);
  store(contact_response, result.contact_response);
  store(delassus, result.contact_delassus);
}

LocalModeler::LocalModeler(const dynamics::Model& model) : data_(std::make_unique<Data>(model)) {}
LocalModeler::~LocalModeler() = default;
LocalModeler::LocalModeler(LocalModeler&&) noexcept = default;
LocalModeler& LocalModeler::operator=(LocalModeler&&) noexcept = default;

bool LocalModeler::make(const TrialStep& trial, std::span<const PointerPort> pointers, double tick,
                        LocalModel& result) {
  Data& data = *data_;
  data.choose(trial, pointers.first(std::min<std::size_t>(pointers.size(), kMostPointers)), result);
  if (!data.response.measure(data.model, trial.before, trial.workspace, trial.length, data.ports)) {
    return false;
  }
  result.tick = tick;
  result.length = trial.length;
  data.place_ports(pointers, result);
  data.place_contacts(trial, result);
  data.find_inverses();
  data.find_drift(trial, result);
  data.find_response(result);
  data.find_contact_response(result);
  return true;
}

}  // namespace layfigure::haptics
