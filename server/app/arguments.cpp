#include "layfigure/app/arguments.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace layfigure::app {
namespace {

constexpr double kMaxInteger = 9007199254740992.0;  // 2^53: every whole number up to it is a double

std::string to_text(double value) {
  std::ostringstream out;
  out.precision(12);
  out << value;
  return out.str();
}

std::string quoted(std::string_view name) { return "argument '" + std::string(name) + "'"; }

}  // namespace

std::optional<Eigen::Quaterniond> unit_quaternion(std::span<const double, 4> wxyz) {
  const Eigen::Quaterniond rotation(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  return std::abs(rotation.norm() - 1.0) <= kUnitTolerance ? std::optional(rotation.normalized()) : std::nullopt;
}

Arguments::Arguments(const command_t& command, std::span<const std::string_view> names) : command_(command) {
  for (const argument_t& argument : command.arguments) {
    if (std::ranges::find(names, argument.name) == names.end()) {
      throw Refusal(command.name + " has no " + quoted(argument.name));
    }
    if (std::ranges::count(command.arguments, argument.name, &argument_t::name) > 1) {
      throw Refusal(quoted(argument.name) + " comes twice");
    }
  }
}

const argument_t* Arguments::find(std::string_view name) const {
  const auto found = std::ranges::find(command_.arguments, name, &argument_t::name);
  return found == command_.arguments.end() ? nullptr : &*found;
}

const argument_t* Arguments::find_numbers(std::string_view name) const {
  const argument_t* argument = find(name);
  if (argument != nullptr && !argument->text.empty()) {
    throw Refusal(quoted(name) + " is the text '" + argument->text + "', expected numbers");
  }
  return argument;
}

std::optional<std::string> Arguments::text(std::string_view name) const {
  const argument_t* argument = find(name);
  if (argument == nullptr) return std::nullopt;
  if (argument->text.empty() || argument->value_count > 0) throw Refusal(quoted(name) + " is not a text");
  return argument->text;
}

std::optional<double> Arguments::number(std::string_view name, double min, double max) const {
  const argument_t* argument = find_numbers(name);
  if (argument == nullptr) return std::nullopt;
  if (argument->value_count != 1) {
    throw Refusal(quoted(name) + " has " + std::to_string(argument->value_count) + " numbers, expected 1");
  }
  const double value = argument->values[0];
  if (value >= min && value <= max) return value;
  throw Refusal(quoted(name) + " is " + to_text(value) + ", expected " + to_text(min) + " to " + to_text(max));
}

std::optional<std::int64_t> Arguments::integer(std::string_view name, std::int64_t min, std::int64_t max) const {
  const std::optional<double> value = number(name, static_cast<double>(min), static_cast<double>(max));
  if (!value) return std::nullopt;
  if (*value != std::floor(*value))
    throw Refusal(quoted(name) + " is " + to_text(*value) + ", expected a whole number");
  return static_cast<std::int64_t>(*value);
}

std::optional<bool> Arguments::flag(std::string_view name) const {
  const std::optional<std::int64_t> value = integer(name, 0, 1);
  return value ? std::optional(*value == 1) : std::nullopt;
}

std::optional<Eigen::Vector3d> Arguments::vector(std::string_view name, double max) const {
  const std::span<const double> values = numbers(name, 3, max);
  return values.empty() ? std::nullopt : std::optional(Eigen::Vector3d(values[0], values[1], values[2]));
}

std::span<const double> Arguments::numbers(std::string_view name, int count, double max) const {
  const argument_t* argument = find_numbers(name);
  if (argument == nullptr) return {};
  const auto usable = [max](double value) { return std::abs(value) <= max; };
  if (argument->value_count != count || !std::ranges::all_of(argument->values, usable)) {
    throw Refusal(quoted(name) + " is not " + std::to_string(count) + " numbers between " + to_text(-max) + " and " +
                  to_text(max));
  }
  return argument->values;
}

std::span<const double> Arguments::any_numbers(std::string_view name, double max) const {
  const argument_t* argument = find_numbers(name);
  return argument == nullptr ? std::span<const double>{} : numbers(name, argument->value_count, max);
}

std::span<const double> Arguments::integers(std::string_view name) const {
  const argument_t* argument = find_numbers(name);
  if (argument == nullptr) return {};
  for (const double value : argument->values) {
    if (value >= 0.0 && value <= kMaxInteger && value == std::floor(value)) continue;
    throw Refusal(quoted(name) + " has " + to_text(value) + ", expected whole numbers from 0");
  }
  return argument->values;
}

}  // namespace layfigure::app
