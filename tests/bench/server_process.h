#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace layfigure::bench {

/// A layfigure-server of its own process. Ends with the object.
class ServerProcess {
 public:
  /// Runs `program` with these arguments and waits until it listens. Throws std::runtime_error.
  ServerProcess(const std::string& program, const std::vector<std::string>& arguments);
  ~ServerProcess();
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  /// Where it is found: an LCM URL.
  [[nodiscard]] const std::string& url() const { return url_; }

 private:
  pid_t process_{-1};
  std::string url_;
};

/// Moves this process and its children to a network of their own, with nothing but a loopback device that takes
/// multicast. False if that is not allowed here. To be called before there are threads.
[[nodiscard]] bool enter_own_network();

}  // namespace layfigure::bench
