#include "layfigure/haptics/passivity.h"

#include <algorithm>

namespace layfigure::haptics {
namespace {

void enter(double energy, double dissipated, PassivityLedger& ledger) noexcept {
  ledger.energy += energy;
  ledger.dissipated += dissipated;
  ledger.lowest = std::min(ledger.lowest, ledger.energy);
}

double debt_of(const PassivityLedger& ledger) noexcept { return -(ledger.energy + ledger.credit); }

}  // namespace

void Passivity::observe(int pointer, const PassivityPort& port) noexcept {
  const Held& held = held_[pointer];
  const double energy = -held.force.dot(port.displacement) - held.torque.dot(port.turn);
  const double dissipated = -held.damping_force.dot(port.displacement) - held.damping_torque.dot(port.turn);
  enter(energy, dissipated, ledgers_[pointer]);
  enter(energy, dissipated, together_);
}

/// Pays a debt by damping these pointers alike.
void Passivity::damp(double T, double debt, std::span<PassivityPort> ports, int first) noexcept {
  if (!(debt > 0.0)) return;
  const double r2 = options_.radius * options_.radius;
  double square = 0.0;
  for (const PassivityPort& port : ports) {
    square += (port.displacement.squaredNorm() + r2 * port.turn.squaredNorm()) / (T * T);
  }
  if (!(square > 0.0)) return;
  const double alpha = std::min(debt / (T * square), options_.max_damping);
  for (std::size_t k = 0; k < ports.size(); ++k) {
    Held& held = held_[first + k];
    held.damping_force = -(alpha / T) * ports[k].displacement;
    held.damping_torque = -(alpha * r2 / T) * ports[k].turn;
    ports[k].force += held.damping_force;
    ports[k].torque += held.damping_torque;
  }
}

void Passivity::tick(double T, std::span<PassivityPort> ports) noexcept {
  if (options_.judge == PassivityOptions::Judge::kOff) return;
  const std::span<PassivityPort> known = ports.first(std::min<std::size_t>(ports.size(), kMostPointers));
  for (std::size_t k = 0; k < known.size(); ++k) {
    observe(static_cast<int>(k), known[k]);
    held_[k].damping_force.setZero();
    held_[k].damping_torque.setZero();
  }
  if (options_.judge == PassivityOptions::Judge::kTogether) {
    damp(T, debt_of(together_), known, 0);
  } else {
    for (std::size_t k = 0; k < known.size(); ++k) {
      damp(T, debt_of(ledgers_[k]), known.subspan(k, 1), static_cast<int>(k));
    }
  }
  for (std::size_t k = 0; k < known.size(); ++k) {
    held_[k].force = known[k].force;
    held_[k].torque = known[k].torque;
  }
}

void Passivity::hold(int pointer, const Eigen::Vector3d& force, const Eigen::Vector3d& torque) noexcept {
  held_[pointer].force = force;
  held_[pointer].torque = torque;
}

void Passivity::grant(int pointer, double energy) noexcept {
  ledgers_[pointer].credit += energy;
  together_.credit += energy;
}

void Passivity::reset(int pointer) noexcept {
  const PassivityLedger& gone = ledgers_[pointer];
  together_.energy -= gone.energy;
  together_.dissipated -= gone.dissipated;
  together_.credit -= gone.credit;
  ledgers_[pointer] = {};
  held_[pointer] = {};
}

void Passivity::reset() noexcept {
  held_.fill({});
  ledgers_.fill({});
  together_ = {};
}

}  // namespace layfigure::haptics
