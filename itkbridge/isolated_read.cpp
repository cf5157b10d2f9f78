#include "itkbridge/isolated_read.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <new>
#include <optional>
#include <system_error>

#include "deform/errors.h"

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define TETWARP_SANITIZED
#endif
#elif defined(__SANITIZE_ADDRESS__)
#define TETWARP_SANITIZED
#endif
#ifdef TETWARP_SANITIZED
#include <sanitizer/common_interface_defs.h>
#endif

namespace tetwarp {
namespace {

// The first byte through the pipe. Then the words, or the number of records and each of them: its type, its fixed
// parameters, its parameters; before each of these how many there are.
enum class Answer : char { records, refusal, no_memory };

// --- the child

/// Writes to the pipe; the parent reads all of it, or the child is killed.
class PipeWriter {
 public:
  explicit PipeWriter(int pipe) : pipe_(pipe) {}

  void write(const void* data, std::size_t size) const {
    const char* bytes = static_cast<const char*>(data);
    while (size > 0) {
      const ssize_t count = ::write(pipe_, bytes, size);
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) ::_exit(1);
      bytes += count;
      size -= static_cast<std::size_t>(count);
    }
  }
  void answer(Answer answer) const { write(&answer, sizeof answer); }
  void number(std::uint64_t value) const { write(&value, sizeof value); }
  template <class Array>
  void array(const Array& values) const {
    number(values.size());
    write(values.data(), values.size() * sizeof(values[0]));
  }

 private:
  int pipe_;
};

/// Bytes of memory of this process that can be written, which is what RLIMIT_DATA counts.
std::uint64_t writable_memory() {
  std::uint64_t pages = 0;
  std::ifstream statm("/proc/self/statm");
  for (int n = 0; n < 6; ++n) statm >> pages;  // size, resident, shared, text, lib, data
  return pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

/// Lowers a limit of this process, or does nothing where it is lower.
void lower(__rlimit_resource resource, std::uint64_t to) {
  rlimit limit{};
  if (::getrlimit(resource, &limit) != 0) return;
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_cur, to);
  ::setrlimit(resource, &limit);
}

/// Puts the limits upon this process, and makes it end in silence whatever handlers the program has.
void confine(const IsolatedLimits& limits) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  lower(RLIMIT_CORE, 0);
  lower(RLIMIT_DATA, writable_memory() + limits.memory_bytes);
  lower(RLIMIT_CPU, limits.cpu_seconds);
  sigset_t ending;
  sigemptyset(&ending);
  for (const int signal : {SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT, SIGPIPE, SIGALRM, SIGXCPU}) {
    sigaddset(&ending, signal);
    ::signal(signal, SIG_DFL);
  }
  ::pthread_sigmask(SIG_UNBLOCK, &ending, nullptr);
  ::alarm(limits.seconds);
  if (const int nothing = ::open("/dev/null", O_WRONLY | O_CLOEXEC); nothing >= 0) {
    ::dup2(nothing, STDOUT_FILENO);
    ::dup2(nothing, STDERR_FILENO);
  }
#ifdef TETWARP_SANITIZED
  __sanitizer_set_death_callback(nullptr);  // a fuzzer's, which would take this for its own end
#endif
}

void send(const PipeWriter& pipe, const std::vector<TransformRecord>& records) {
  pipe.answer(Answer::records);
  pipe.number(records.size());
  for (const TransformRecord& record : records) {
    pipe.array(record.type);
    pipe.array(record.fixed);
    pipe.array(record.parameters);
  }
}

[[noreturn]] void run_child(int out, const std::function<std::vector<TransformRecord>()>& read,
                            const IsolatedLimits& limits) {
  const PipeWriter pipe(out);
  try {
    confine(limits);
    send(pipe, read());
    ::_exit(0);
  } catch (const InputError& error) {
    pipe.answer(Answer::refusal);
    pipe.array(std::string_view(error.what()));
  } catch (const std::bad_alloc&) {
    pipe.answer(Answer::no_memory);
  } catch (...) {
  }
  ::_exit(1);
}

// --- the parent

struct Broken {};  // the pipe ended, or says what cannot be

/// A child process and the pipe from it.
class Child {
 public:
  Child(const std::function<std::vector<TransformRecord>()>& run, const IsolatedLimits& limits,
        const std::string& file) {
    const auto fail = [&](const char* call, int error) {
      throw Error("cannot read " + file + " in a process of its own: " + call + ": " +
                  std::generic_category().message(error));
    };
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) fail("pipe", errno);
    id_ = ::fork();
    const int error = errno;
    if (id_ == 0) run_child(ends[1], run, limits);
    in_ = ends[0];
    ::close(ends[1]);
    if (id_ > 0) return;
    ::close(in_);
    fail("fork", error);
  }
  ~Child() {
    if (!status_) {
      ::kill(id_, SIGKILL);
      wait();
    }
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  void read(void* data, std::size_t size) const {
    char* bytes = static_cast<char*>(data);
    while (size > 0) {
      const ssize_t count = ::read(in_, bytes, size);
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) throw Broken();
      bytes += count;
      size -= static_cast<std::size_t>(count);
    }
  }
  std::uint64_t number() const {
    std::uint64_t value = 0;
    read(&value, sizeof value);
    return value;
  }
  /// @param room  bytes, of which the array takes some: a child whose memory is damaged may say anything
  template <class Array>
  Array array(std::size_t& room) const {
    const std::uint64_t count = number();
    if (count > room / sizeof(typename Array::value_type)) throw Broken();
    room -= count * sizeof(typename Array::value_type);
    Array values(count, typename Array::value_type{});
    read(values.data(), count * sizeof(typename Array::value_type));
    return values;
  }
  /// The status by waitpid; 0 where a program that lets its children go has it.
  int wait() {
    int status = 0;
    ::close(in_);
    pid_t done = 0;
    do done = ::waitpid(id_, &status, 0);
    while (done < 0 && errno == EINTR);
    status_ = done == id_ ? status : 0;
    return *status_;
  }

 private:
  pid_t id_ = -1;
  int in_ = -1;
  std::optional<int> status_;
};

std::vector<TransformRecord> receive(const Child& child, std::size_t& room) {
  std::vector<TransformRecord> records;
  for (std::uint64_t left = child.number(); left > 0; --left) {
    TransformRecord& record = records.emplace_back();
    record.type = child.array<std::string>(room);
    record.fixed = child.array<std::vector<double>>(room);
    record.parameters = child.array<std::vector<double>>(room);
  }
  return records;
}

std::string ending(int status, const IsolatedLimits& limits) {
  if (!WIFSIGNALED(status)) return "ends without a result";
  const int signal = WTERMSIG(status);
  if (signal == SIGXCPU) return "takes more than " + std::to_string(limits.cpu_seconds) + " s of CPU time";
  if (signal == SIGALRM) return "takes more than " + std::to_string(limits.seconds) + " s";
  return std::string("crashes (") + ::strsignal(signal) + ")";
}

}  // namespace

std::vector<TransformRecord> read_isolated(const std::function<std::vector<TransformRecord>()>& read,
                                           const IsolatedLimits& limits, const std::string& library,
                                           const std::string& file) {
  Child child(read, limits, file);
  std::size_t room = limits.memory_bytes;
  std::string failure;
  try {
    Answer answer{};
    child.read(&answer, sizeof answer);
    if (answer == Answer::refusal) throw InputError(child.array<std::string>(room));
    if (answer == Answer::records) {
      std::vector<TransformRecord> records = receive(child, room);
      child.wait();
      return records;
    }
    failure = "asks for more than " + std::to_string(limits.memory_bytes >> 20) + " MiB";
  } catch (const Broken&) {
    failure = ending(child.wait(), limits);
  }
  throw InputError(library + " cannot read " + file + ": it " + failure + "; the file may be truncated or damaged");
}

}  // namespace tetwarp
