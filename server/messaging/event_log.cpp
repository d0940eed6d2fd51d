#include "layfigure/messaging/event_log.h"

#include <fcntl.h>
#include <lcm/eventlog.h>
#include <spdlog/spdlog.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace layfigure::messaging {
namespace {

constexpr std::chrono::milliseconds kFlushInterval{200};

std::int64_t wall_clock_us() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(now).count();
}

struct Waiting {
  std::int64_t time_us;
  std::string channel;
  Bytes bytes;
};

std::size_t size_of(const std::string& channel, const Bytes& bytes) { return channel.size() + bytes.size(); }

/// Open, and ours alone until it is closed.
int lock_file(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  if (file < 0) throw LogError("cannot write the log '" + path.string() + "': " + std::strerror(errno));
  if (::flock(file, LOCK_EX | LOCK_NB) == 0) return file;
  ::close(file);
  throw LogError("the log '" + path.string() + "' is being written by another process: choose another name");
}

}  // namespace

struct EventLogWriter::Impl {
  explicit Impl(const std::filesystem::path& name)
      : path(name), lock(lock_file(name)), log(lcm_eventlog_create(name.c_str(), "w")) {
    if (log == nullptr) {
      ::close(lock);
      throw LogError("cannot write the log '" + path.string() + "': " + std::strerror(errno));
    }
    thread = std::thread([this] { run(); });
  }

  void run();
  [[nodiscard]] bool put(Waiting& event) const;
  void end(const std::string& why);

  const std::filesystem::path path;
  const int lock;
  lcm_eventlog_t* const log;
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<Waiting> queue;
  std::size_t waiting{0};  ///< bytes in the queue
  bool closing{false};
  bool ended{false};
  std::thread thread;  // last: it uses the others
};

bool EventLogWriter::Impl::put(Waiting& event) const {
  lcm_eventlog_event_t record{};
  record.timestamp = event.time_us;
  record.channellen = static_cast<std::int32_t>(event.channel.size());
  record.datalen = static_cast<std::int32_t>(event.bytes.size());
  record.channel = event.channel.data();
  record.data = event.bytes.data();
  return lcm_eventlog_write_event(log, &record) == 0;
}

void EventLogWriter::Impl::end(const std::string& why) {
  {
    const std::lock_guard guard(mutex);
    if (std::exchange(ended, true)) return;
    queue.clear();
    waiting = 0;
  }
  spdlog::error("the log '{}' ends here: {}", path.string(), why);
}

void EventLogWriter::Impl::run() {
  std::vector<Waiting> batch;
  for (bool last = false; !last;) {
    {
      std::unique_lock guard(mutex);
      changed.wait_for(guard, kFlushInterval, [&] { return closing; });
      last = closing;
      batch.swap(queue);
      waiting = 0;
    }
    bool sound = true;
    for (Waiting& event : batch) sound = sound && put(event);
    if (!batch.empty() && (!sound || std::fflush(log->f) != 0)) end(std::strerror(errno));
    batch.clear();
  }
}

EventLogWriter::EventLogWriter(const std::filesystem::path& path) : impl_(std::make_unique<Impl>(path)) {}

EventLogWriter::~EventLogWriter() {
  {
    const std::lock_guard guard(impl_->mutex);
    impl_->closing = true;
  }
  impl_->changed.notify_one();
  impl_->thread.join();
  lcm_eventlog_destroy(impl_->log);
  ::close(impl_->lock);
}

void EventLogWriter::write(std::string channel, Bytes bytes) {
  const std::size_t size = size_of(channel, bytes);
  {
    const std::lock_guard guard(impl_->mutex);
    if (impl_->ended) return;
    if (impl_->waiting + size <= kMostWaiting) {
      impl_->queue.push_back({wall_clock_us(), std::move(channel), std::move(bytes)});
      impl_->waiting += size;
      return;
    }
  }
  impl_->end("the disk is too slow for it");
}

struct EventLogReader::Impl {
  lcm_eventlog_t* log;
};

EventLogReader::EventLogReader(const std::filesystem::path& path)
    : impl_(std::make_unique<Impl>(Impl{lcm_eventlog_create(path.c_str(), "r")})) {
  if (impl_->log == nullptr) throw LogError("cannot read the log '" + path.string() + "': " + std::strerror(errno));
}

EventLogReader::~EventLogReader() { lcm_eventlog_destroy(impl_->log); }

std::optional<LogEvent> EventLogReader::next() {
  lcm_eventlog_event_t* event = lcm_eventlog_read_next_event(impl_->log);
  if (event == nullptr) return std::nullopt;
  const auto* data = static_cast<const std::uint8_t*>(event->data);
  LogEvent result{std::string(event->channel, event->channellen), Bytes(data, data + event->datalen)};
  lcm_eventlog_free_event(event);
  return result;
}

}  // namespace layfigure::messaging
