#include "layfigure/app/stderr_log.h"

#include <limits.h>
#include <poll.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <mutex>

namespace layfigure::app {
namespace {

class StderrSink : public spdlog::sinks::base_sink<std::mutex> {
 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    pollfd out{STDERR_FILENO, POLLOUT, 0};
    if (poll(&out, 1, 0) != 1 || (out.revents & POLLOUT) == 0) return;
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    // A pipe that can be written to has room for so much: see pipe(7).
    const std::size_t size = std::min<std::size_t>(line.size(), PIPE_BUF);
    [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, line.data(), size);
  }
  void flush_() override {}
};

}  // namespace

void log_to_stderr(const std::string& name) {
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(name, std::make_shared<StderrSink>()));
  spdlog::set_pattern("%n: %v");
}

}  // namespace layfigure::app
