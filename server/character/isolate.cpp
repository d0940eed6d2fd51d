#include "isolate.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <exception>
#include <new>
#include <stdexcept>
#include <system_error>

namespace layfigure::character {
namespace {

constexpr int kFailed = 3;  // exit status of a child whose work threw

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kMemoryCanBeLimited = false;
#else
constexpr bool kMemoryCanBeLimited = true;
#endif

[[noreturn]] void fail(const char* what) { throw std::system_error(errno, std::generic_category(), what); }

bool write_all(int pipe, const std::string& bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t count = ::write(pipe, bytes.data() + done, bytes.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    done += static_cast<std::size_t>(count);
  }
  return true;
}

std::string read_all(int pipe) {
  std::string bytes;
  std::array<char, 1 << 16> block{};
  for (;;) {
    const ssize_t count = ::read(pipe, block.data(), block.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return bytes;
    bytes.append(block.data(), static_cast<std::size_t>(count));
  }
}

/// Lowers a limit; one that is lower already stays.
void limit(int resource, rlim_t most) {
  const auto which = static_cast<__rlimit_resource>(resource);
  rlimit limits{};
  ::getrlimit(which, &limits);
  limits.rlim_cur = limits.rlim_max = std::min(most, limits.rlim_max);
  ::setrlimit(which, &limits);
}

/// What a crashing library says on its way out is no message for users.
void silence() {
  const int nothing = ::open("/dev/null", O_WRONLY);
  ::dup2(nothing, STDOUT_FILENO);
  ::dup2(nothing, STDERR_FILENO);
}

[[noreturn]] void run_child(int pipe, const std::function<std::string()>& work, const ChildLimits& limits) {
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, limits.seconds);
  if (kMemoryCanBeLimited) limit(RLIMIT_AS, limits.memory);
  silence();
  for (const int signal : {SIGINT, SIGTERM, SIGABRT, SIGSEGV, SIGXCPU}) std::signal(signal, SIG_DFL);
  int status = 0;
  std::string result;
  try {
    result = work();
  } catch (const std::bad_alloc&) {
    result = "it is too large for this machine's memory; reduce its meshes";
    status = kFailed;
  } catch (const std::exception& error) {
    result = error.what();
    status = kFailed;
  } catch (...) {
    result = "unknown error";
    status = kFailed;
  }
  // No destructors or exit handlers: they belong to the parent.
  ::_exit(write_all(pipe, result) ? status : 1);
}

int wait_for(pid_t child) {
  int status = 0;
  while (::waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) fail("waitpid");
  }
  return status;
}

}  // namespace

std::string run_isolated(const std::function<std::string()>& work, const ChildLimits& limits) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) fail("pipe");
  const pid_t child = ::fork();
  if (child < 0) {
    ::close(ends[0]);
    ::close(ends[1]);
    fail("fork");
  }
  if (child == 0) run_child(ends[1], work, limits);
  ::close(ends[1]);
  std::string result = read_all(ends[0]);
  ::close(ends[0]);
  const int status = wait_for(child);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return result;
  if (WIFEXITED(status) && WEXITSTATUS(status) == kFailed) throw std::runtime_error(result);
  const bool slow = WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL);
  throw std::runtime_error(
      slow ? "it is too large: the import was stopped; reduce its meshes"
           : "it crashes its reader: it is broken, or holds what that does not know; export it again");
}

}  // namespace layfigure::character
