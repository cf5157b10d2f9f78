// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/isolated/read_child.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <new>
#include <string>

#include "deform/errors.h"
#include "deform/text/text_number.h"
#include "itkbridge/isolated/isolated_answer.h"

namespace tetwarp {
namespace {

/// Ends this process without destructors of static objects and handlers of `exit`, since the reader may have damaged
/// anything.
[[noreturn]] void end(int status) { ::_exit(status); }

/// Writes the answer. The process that started this one reads all of it, or kills this process.
class AnswerWriter {
 public:
  void text(std::string_view text) const { write(text.data(), text.size()); }
  void answer(Answer answer) const { write(&answer, sizeof answer); }
  void number(std::uint64_t value) const { write(&value, sizeof value); }
  template <class Array>
  void array(const Array& values) const {
    number(values.size());
    write(values.data(), values.size() * sizeof(values[0]));
  }
  void records(const std::vector<ReadRecord>& records) const {
    answer(Answer::records);
    number(records.size());
    for (const ReadRecord& record : records) {
      array(record.name);
      array(record.head);
      array(record.values);
    }
  }

 private:
  void write(const void* data, std::size_t size) const {
    const char* bytes = static_cast<const char*>(data);
    while (size > 0) {
      const ssize_t count = ::write(kAnswerDescriptor, bytes, size);
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) end(1);
      bytes += count;
      size -= static_cast<std::size_t>(count);
    }
  }
};

/// What the process is told to do, from its arguments.
struct Request {
  std::string_view kind;
  const char* file = nullptr;
  std::uint64_t part = 0;
  std::uint64_t memory_bytes = 0;
  unsigned cpu_seconds = 0;
  unsigned seconds = 0;
  pid_t parent = 0;
};

template <class Number>
bool parse(std::string_view text, Number& number) {
  const auto read = number_from<Number>(text);
  number = read.value_or(0);
  return read.has_value();
}

bool parse(int argc, char** argv, Request& request) {
  if (argc != kReadArguments + 1) return false;
  request.kind = argv[1];
  request.file = argv[2];
  return parse(argv[3], request.part) && parse(argv[4], request.memory_bytes) && parse(argv[5], request.cpu_seconds) &&
         parse(argv[6], request.seconds) && parse(argv[7], request.parent);
}

/// Bytes of memory of this process that can be written: what RLIMIT_DATA counts.
std::uint64_t writable_memory() {
  std::uint64_t pages = 0;
  std::ifstream statm("/proc/self/statm");
  for (int n = 0; n < 6; ++n) statm >> pages;  // size, resident, shared, text, lib, data
  return pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

/// Lowers a limit of this process to `to`, or leaves it where it is lower.
void limit_to(__rlimit_resource resource, std::uint64_t to) {
  rlimit limit{};
  if (::getrlimit(resource, &limit) != 0) return;
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_cur, to);
  ::setrlimit(resource, &limit);
}

/// Sets the limits of this process, and lets the system end it together with the one that started it.
void confine(const Request& request) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != request.parent) end(1);  // the other process has ended already
  limit_to(RLIMIT_CORE, 0);
  limit_to(RLIMIT_DATA, writable_memory() + request.memory_bytes);
  limit_to(RLIMIT_CPU, request.cpu_seconds);
  ::alarm(request.seconds);
}

}  // namespace

int answer_read(int argc, char** argv, std::span<const ChildReader> readers) {
  Request request;
  const auto reader = [&] { return std::ranges::find(readers, request.kind, &ChildReader::kind); };
  if (!parse(argc, argv, request) || reader() == readers.end() || ::fcntl(kAnswerDescriptor, F_GETFD) < 0) {
    std::fprintf(stderr, "tetwarp-read: reads one file for Tetwarp, which starts it; it does nothing by hand\n");
    return 2;
  }
  const AnswerWriter to;
  try {
    to.text(kReadGreeting);
    confine(request);
    to.records(reader()->read(request.file, request.part));
    end(0);
  } catch (const InputError& error) {
    to.answer(Answer::refusal);
    to.array(std::string_view(error.what()));
  } catch (const std::bad_alloc&) {
    to.answer(Answer::no_memory);
  } catch (...) {
  }
  end(1);
}

}  // namespace tetwarp
