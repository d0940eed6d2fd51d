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

Arguments::Arguments(const command_t& command, std::initializer_list<std::string_view> names) : command_(command) {
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

std::optional<Eigen::Vector3d> Arguments::vector(std::string_view name, double max) const {
  const argument_t* argument = find_numbers(name);
  if (argument == nullptr) return std::nullopt;
  const auto usable = [max](double value) { return std::abs(value) <= max; };
  if (argument->value_count != 3 || !std::ranges::all_of(argument->values, usable)) {
    throw Refusal(quoted(name) + " is not 3 numbers between " + to_text(-max) + " and " + to_text(max));
  }
  return Eigen::Vector3d(argument->values[0], argument->values[1], argument->values[2]);
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
