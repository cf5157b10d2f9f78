// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/isolated/isolated_read.h"

#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <optional>

#include "deform/errors.h"
#include "itkbridge/child_process.h"
#include "itkbridge/isolated/isolated_answer.h"
#include "itkbridge/isolated/read_program.h"

namespace tetwarp {
namespace {

struct Broken {};  // the pipe ended, or what it says is impossible

/// Reads the answer from the pipe and checks every number: a program whose memory is damaged may write anything.
class AnswerReader {
 public:
  /// @param room  bytes that all records together may take
  AnswerReader(int pipe, std::size_t room) : pipe_(pipe), room_(room) {}

  void read(void* data, std::size_t size) const {
    char* bytes = static_cast<char*>(data);
    while (size > 0) {
      const ssize_t count = ::read(pipe_, bytes, size);
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) throw Broken();
      bytes += count;
      size -= static_cast<std::size_t>(count);
    }
  }
  void greeting() const {
    char said[kReadGreeting.size()];
    read(said, sizeof said);
    if (std::string_view(said, sizeof said) != kReadGreeting) throw Broken();
  }
  Answer answer() const {
    Answer answer{};
    read(&answer, sizeof answer);
    return answer;
  }
  template <class Array>
  Array array() {
    const std::uint64_t count = number();
    take(count, sizeof(typename Array::value_type));
    Array values(count, typename Array::value_type{});
    read(values.data(), count * sizeof(typename Array::value_type));
    return values;
  }
  std::vector<ReadRecord> records() {
    std::vector<ReadRecord> records;
    for (std::uint64_t left = number(); left > 0; --left) {
      take(1, sizeof(ReadRecord));
      ReadRecord& record = records.emplace_back();
      record.name = array<std::string>();
      record.head = array<std::vector<double>>();
      record.values = array<std::vector<double>>();
    }
    return records;
  }

 private:
  std::uint64_t number() const {
    std::uint64_t value = 0;
    read(&value, sizeof value);
    return value;
  }
  void take(std::uint64_t count, std::size_t size) {
    if (count > room_ / size) throw Broken();
    room_ -= count * size;
  }

  int pipe_;
  std::size_t room_;
};

std::string ending(std::optional<int> status, const IsolatedLimits& limits) {
  if (!status || !WIFSIGNALED(*status)) return "ends without a result";
  const int signal = WTERMSIG(*status);
  if (signal == SIGXCPU) return "takes more than " + std::to_string(limits.cpu_seconds) + " s of CPU time";
  if (signal == SIGALRM) return "takes more than " + std::to_string(limits.seconds) + " s";
  return std::string("crashes (") + ::strsignal(signal) + ")";
}

/// Throws the error of a program that ended, or wrote something else, before it began to read, which is no fault of the
/// file.
[[noreturn]] void refuse_program(const std::filesystem::path& program, const std::string& file,
                                 std::optional<int> status) {
  std::string end = "it does not answer as this version expects";
  if (status && WIFEXITED(*status) && WEXITSTATUS(*status) != 0)
    end = "it ends with status " + std::to_string(WEXITSTATUS(*status));
  if (status && WIFSIGNALED(*status)) end = std::string("it crashes (") + ::strsignal(WTERMSIG(*status)) + ")";
  throw Error("the program " + program.string() + " cannot read " + file + ": " + end +
              " before it begins; install Tetwarp again, or name its program by " + kReadProgramVariable);
}

}  // namespace

std::vector<ReadRecord> read_isolated(const std::string& kind, const std::filesystem::path& path, std::uint64_t part,
                                      const IsolatedLimits& limits, const std::string& library,
                                      const std::stop_token& stop) {
  const std::string file = path.string();
  const std::filesystem::path program = find_read_program(file);
  Pipe pipe = make_pipe();
  ChildProcess child(program,
                     {kind, file, std::to_string(part), std::to_string(limits.memory_bytes),
                      std::to_string(limits.cpu_seconds), std::to_string(limits.seconds), std::to_string(::getpid())},
                     {.further = pipe.write.number()});
  pipe.write.close();
  const std::stop_callback at_once(stop, [&] { child.kill(); });
  AnswerReader from(pipe.read.number(), limits.memory_bytes);
  bool begun = false;
  std::string failure;
  try {
    from.greeting();
    begun = true;
    const Answer answer = from.answer();
    if (answer == Answer::refusal) throw InputError(from.array<std::string>());
    if (answer == Answer::records) return from.records();
    failure = "asks for more than " + std::to_string(limits.memory_bytes >> 20) + " MiB";
  } catch (const Broken&) {
    pipe.read.close();
    const std::optional<int> status = child.wait();
    if (stop.stop_requested()) throw Cancelled();
    if (!begun) refuse_program(program, file, status);
    failure = ending(status, limits);
  }
  throw InputError(library + " cannot read " + file + ": it " + failure + "; the file may be truncated or damaged");
}

}  // namespace tetwarp
