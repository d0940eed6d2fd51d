#include "scene_file.h"

#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <type_traits>

#include "scene_fields.h"

namespace layfigure::testing {
namespace {

using Json = nlohmann::ordered_json;

// JSON has no numbers for these.
constexpr const char* kInfinite = "inf";
constexpr const char* kMinusInfinite = "-inf";
constexpr const char* kNotANumber = "nan";

Json json_of(double value) {
  if (std::isnan(value)) return kNotANumber;
  if (std::isinf(value)) return value > 0.0 ? kInfinite : kMinusInfinite;
  return value;
}

double number_of(const Json& json) {
  if (!json.is_string()) return json.get<double>();
  if (json == kNotANumber) return std::numeric_limits<double>::quiet_NaN();
  if (json == kInfinite) return std::numeric_limits<double>::infinity();
  if (json == kMinusInfinite) return -std::numeric_limits<double>::infinity();
  throw std::runtime_error("'" + json.get<std::string>() + "' is not a number");
}

class Writer {
 public:
  explicit Writer(Json& json) : json_(json) {}
  template <class Value>
  void operator()(const char* name, Value& value) {
    Writer(json_[name]).put(value);
  }

  void put(double& value) { json_ = json_of(value); }
  void put(std::string& value) { json_ = value; }
  template <class Value>
  requires std::is_integral_v<Value>
  void put(Value& value) { json_ = value; }
  template <class Value>
  requires std::is_enum_v<Value>
  void put(Value& value) { json_ = static_cast<int>(value); }
  template <int kRows, int kColumns>
  void put(Eigen::Matrix<double, kRows, kColumns>& m) {
    for (const double value : m.reshaped()) json_.push_back(json_of(value));
  }
  void put(Eigen::Quaterniond& q) {
    for (const double value : {q.w(), q.x(), q.y(), q.z()}) json_.push_back(json_of(value));
  }
  void put(collision::Shape& shape) {
    json_["kind"] = shape.index();
    std::visit([this](auto& value) { fields(*this, value); }, shape);
  }
  template <class Value, std::size_t kCount>
  void put(std::array<Value, kCount>& list) {
    for (Value& value : list) Writer(json_.emplace_back()).put(value);
  }
  template <class Value>
  void put(std::vector<Value>& list) {
    json_ = Json::array();
    for (Value& value : list) Writer(json_.emplace_back()).put(value);
  }
  template <class Value>
  requires std::is_class_v<Value>
  void put(Value& value) {
    json_ = Json::object();
    fields(*this, value);
  }

 private:
  Json& json_;
};

class Reader {
 public:
  explicit Reader(const Json& json) : json_(json) {}
  template <class Value>
  void operator()(const char* name, Value& value) {
    try {
      Reader(json_.at(name)).take(value);
    } catch (const std::exception& error) {
      throw std::runtime_error(std::string(name) + ": " + error.what());
    }
  }

  void take(double& value) { value = number_of(json_); }
  void take(std::string& value) { value = json_.get<std::string>(); }
  template <class Value>
  requires std::is_integral_v<Value>
  void take(Value& value) { value = json_.get<Value>(); }
  template <class Value>
  requires std::is_enum_v<Value>
  void take(Value& value) { value = static_cast<Value>(json_.get<int>()); }
  template <int kRows, int kColumns>
  void take(Eigen::Matrix<double, kRows, kColumns>& m) {
    for (int k = 0; k < m.size(); ++k) m.reshaped()[k] = number_of(json_.at(k));
  }
  void take(Eigen::Quaterniond& q) {
    Eigen::Vector4d numbers;
    take(numbers);
    q = {numbers[0], numbers[1], numbers[2], numbers[3]};
  }
  void take(collision::Shape& shape) {
    const auto kind = json_.at("kind").get<int>();
    constexpr auto kKinds = std::variant_size_v<collision::Shape>;
    const std::array<collision::Shape, kKinds> kinds{collision::Sphere{}, collision::Capsule{}, collision::ConvexHull{},
                                                     collision::Plane{}};
    shape = kinds.at(kind);
    std::visit([this](auto& value) { fields(*this, value); }, shape);
  }
  template <class Value, std::size_t kCount>
  void take(std::array<Value, kCount>& list) {
    for (std::size_t k = 0; k < kCount; ++k) Reader(json_.at(k)).take(list[k]);
  }
  template <class Value>
  void take(std::vector<Value>& list) {
    list.resize(json_.size());
    for (std::size_t k = 0; k < list.size(); ++k) Reader(json_.at(k)).take(list[k]);
  }
  template <class Value>
  requires std::is_class_v<Value>
  void take(Value& value) { fields(*this, value); }

 private:
  const Json& json_;
};

}  // namespace

void write_scene(const StressScene& scene, const std::string& failure, const std::string& path) {
  Json json;
  json["fails"] = failure;
  StressScene copy = scene;
  Writer writer(json);
  fields(writer, copy);
  std::ofstream(path) << json.dump(1) << '\n';
}

StressScene read_scene(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error(path + ": cannot be read");
  StressScene scene;
  try {
    const Json json = Json::parse(in);
    Reader reader(json);
    fields(reader, scene);
  } catch (const std::exception& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
  return scene;
}

}  // namespace layfigure::testing
