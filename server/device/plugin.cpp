#include "plugin.h"

#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "layfigure_device.h"

namespace layfigure::device {
namespace {

constexpr const char* kSymbol = "layfigure_device_plugin";
constexpr std::size_t kErrorBytes = 512;

struct CloseLibrary {
  void operator()(void* library) const { dlclose(library); }
};
using Library = std::unique_ptr<void, CloseLibrary>;

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& why) {
  throw DeviceError(path.string() + ": " + why);
}

Library load(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) refuse(path, "there is no such plugin; check the path");
  // An absolute path, or the loader would look elsewhere for a bare name.
  Library library(dlopen(std::filesystem::absolute(path).c_str(), RTLD_NOW | RTLD_LOCAL));
  if (library == nullptr) refuse(path, std::string("cannot be loaded as a plugin: ") + dlerror());
  return library;
}

const layfigure_device_functions& functions_of(void* library, const std::filesystem::path& path) {
  const auto get = reinterpret_cast<decltype(&layfigure_device_plugin)>(dlsym(library, kSymbol));
  if (get == nullptr) refuse(path, std::string("no device plugin: it exports no ") + kSymbol + "()");
  const layfigure_device_functions* functions = get();
  if (functions == nullptr) refuse(path, std::string(kSymbol) + "() returned NULL");
  if (functions->version != LAYFIGURE_DEVICE_VERSION) {
    refuse(path, "of version " + std::to_string(functions->version) + " of layfigure_device.h, expected " +
                     std::to_string(LAYFIGURE_DEVICE_VERSION) + ": build it anew");
  }
  const auto need = [&](bool there, const char* name) {
    if (!there) refuse(path, std::string("its function ") + name + " is NULL");
  };
  need(functions->open != nullptr, "open");
  need(functions->info != nullptr, "info");
  need(functions->read != nullptr, "read");
  need(functions->write != nullptr, "write");
  need(functions->exerted != nullptr, "exerted");
  need(functions->close != nullptr, "close");
  return *functions;
}

/// A plugin's text may lack its end.
template <std::size_t N>
std::string text_of(const std::array<char, N>& bytes) {
  return {bytes.begin(), std::find(bytes.begin(), bytes.end(), '\0')};
}

class PluginDriver : public Driver {
 public:
  PluginDriver(Library library, const layfigure_device_functions& functions, const std::filesystem::path& path,
               const std::string& config)
      : library_(std::move(library)), functions_(functions) {
    std::array<char, kErrorBytes> error{};
    device_ = functions_.open(config.c_str(), error.data(), error.size());
    if (device_ == nullptr) {
      const std::string why = text_of(error);
      refuse(path, why.empty() ? "its device does not open, and it does not say why" : why);
    }
    try {
      info_ = read_info(path);
    } catch (...) {
      close();
      throw;
    }
  }
  ~PluginDriver() override { close(); }
  PluginDriver(const PluginDriver&) = delete;
  PluginDriver& operator=(const PluginDriver&) = delete;

  [[nodiscard]] const Info& info() const noexcept override { return info_; }

  [[nodiscard]] Reading read(double time) noexcept override {
    if (device_ == nullptr) return {.status = Reading::Status::kGone};
    layfigure_device_state state{};
    const int result = functions_.read(device_, time, &state);
    if (result == LAYFIGURE_DEVICE_NOTHING_NEW) return {.status = Reading::Status::kNothingNew};
    if (result == LAYFIGURE_DEVICE_GONE) return {.status = Reading::Status::kGone};
    const auto& [w, x, y, z] = state.rotation;
    return {.status = result == LAYFIGURE_DEVICE_OK ? Reading::Status::kOk : Reading::Status::kInvalid,
            .position = Eigen::Vector3d(state.position),
            .rotation = Eigen::Quaterniond(w, x, y, z),
            .grip = state.grip,
            .buttons = state.buttons};
  }

  void write(const Wrench& wrench) noexcept override {
    if (device_ != nullptr) functions_.write(device_, wrench.force.data(), wrench.torque.data());
  }

  [[nodiscard]] Wrench exerted() const noexcept override {
    Wrench wrench;
    if (device_ != nullptr) functions_.exerted(device_, wrench.force.data(), wrench.torque.data());
    return wrench;
  }

  void close() noexcept override {
    if (device_ != nullptr) functions_.close(device_);
    device_ = nullptr;
  }

 private:
  [[nodiscard]] Info read_info(const std::filesystem::path& path) const {
    layfigure_device_info raw{};
    functions_.info(device_, &raw);
    const auto need = [&](bool holds, const char* name, double value, const char* range) {
      if (!holds) refuse(path, std::string(name) + " = " + std::to_string(value) + ", expected " + range);
    };
    const auto is_positive = [](double x) { return std::isfinite(x) && x > 0.0; };
    const auto is_amount = [](double x) { return std::isfinite(x) && x >= 0.0; };
    need(is_amount(raw.max_force), "max_force", raw.max_force, "0 or more newtons");
    need(is_amount(raw.max_torque), "max_torque", raw.max_torque, "0 or more newton metres");
    need(is_positive(raw.reach), "reach", raw.reach, "more than 0 metres");
    need(is_amount(raw.reach_angle), "reach_angle", raw.reach_angle, "0 or more radians");
    const std::string name = text_of(std::to_array(raw.name));
    if (name.empty() || name.size() == sizeof raw.name) refuse(path, "its device has no name that ends");
    return {.name = name,
            .max_force = raw.max_force,
            .max_torque = raw.max_torque,
            .reach = raw.reach,
            .reach_angle = raw.reach_angle};
  }

  Library library_;
  const layfigure_device_functions& functions_;
  layfigure_device* device_{nullptr};
  Info info_;
};

}  // namespace

std::unique_ptr<Driver> open_plugin(const std::filesystem::path& path, const std::string& config) {
  Library library = load(path);
  const layfigure_device_functions& functions = functions_of(library.get(), path);
  return std::make_unique<PluginDriver>(std::move(library), functions, path, config);
}

}  // namespace layfigure::device
