#pragma once

#include "run.h"

/// The factors of the elimination of the joints, read back out of a base step's nodes for path_tree.h.
namespace layfigure::dynamics {

/// A slot's joints as eliminate_joints() had them. In the lanes that it eliminates in section axes E, with D = E^-T,
/// the blocks are in these; elsewhere E = D = 1. X = (A + G)^-1.
template <class T>
struct SlotFactor {
  Articulated<T> own;  ///< world axes
  Mat3<T> axes;        ///< E
  Mat3<T> motion;      ///< D
  Sym3<T> A, G, X;
  Mat3<T> H;
};

[[nodiscard]] SlotFactor<double> factor_of(const Plan<double>& plan, const std::vector<Node<double>>& nodes, int slot);
[[nodiscard]] SlotFactor<math::Lanes4> factor_of(const Plan<math::Lanes4>& plan,
                                                 const std::vector<Node<math::Lanes4>>& nodes, int slot);

}  // namespace layfigure::dynamics
