#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <initializer_list>
#include <layfigure/argument_t.hpp>
#include <layfigure/command_t.hpp>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

namespace layfigure::app {

/// A command that is not carried out. what() is the reply's reason, one line.
class Refusal : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// A quaternion whose length is further from 1 is no client's rounding error.
inline constexpr double kUnitTolerance = 1e-3;

/// The rotation w x y z, normalised; nothing if it is no unit quaternion.
[[nodiscard]] std::optional<Eigen::Quaterniond> unit_quaternion(std::span<const double, 4> wxyz);

/// Typed access to a command's arguments. Every function throws Refusal, naming the argument, the value and what was
/// expected, and returns nothing for an argument that is not there.
class Arguments {
 public:
  /// Refuses arguments whose names are not among `names`, and any that comes twice. `command` must outlive this.
  Arguments(const command_t& command, std::initializer_list<std::string_view> names)
      : Arguments(command, std::span(names.begin(), names.size())) {}
  Arguments(const command_t& command, std::span<const std::string_view> names);

  [[nodiscard]] bool has(std::string_view name) const { return find(name) != nullptr; }
  [[nodiscard]] std::optional<std::string> text(std::string_view name) const;
  /// One finite number in [min, max].
  [[nodiscard]] std::optional<double> number(std::string_view name, double min, double max) const;
  /// One whole number in [min, max].
  [[nodiscard]] std::optional<std::int64_t> integer(std::string_view name, std::int64_t min, std::int64_t max) const;
  /// Three finite numbers, each at most `max` in size.
  [[nodiscard]] std::optional<Eigen::Vector3d> vector(std::string_view name, double max) const;
  /// 0 or 1.
  [[nodiscard]] std::optional<bool> flag(std::string_view name) const;
  /// So many finite numbers, each at most `max` in size. Empty if the argument is not there.
  [[nodiscard]] std::span<const double> numbers(std::string_view name, int count, double max) const;
  /// Numbers of any count, each at most `max` in size. Empty if the argument is not there.
  [[nodiscard]] std::span<const double> any_numbers(std::string_view name, double max) const;
  /// Numbers of any count, each a whole number in [0, 2^53]. Empty if the argument is not there.
  [[nodiscard]] std::span<const double> integers(std::string_view name) const;

 private:
  [[nodiscard]] const argument_t* find(std::string_view name) const;
  [[nodiscard]] const argument_t* find_numbers(std::string_view name) const;

  const command_t& command_;
};

}  // namespace layfigure::app
