// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/documents/json_tree.h"

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <tuple>

#include "deform/errors.h"
#include "io/opened_file.h"

namespace tetwarp {

namespace {

constexpr std::size_t kDeepest = 64, kLongestQuote = 120;

/// The number of the line in which the byte that was taken last stands, and of the one before it.
struct LineCount {
  std::size_t line = 1, before = 1;
};

/// Gives bytes to nlohmann's lexer, which says nothing of lines, and counts the lines as it takes them.
class CountingIterator {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  CountingIterator(const char* at, LineCount* count) : at_(at), count_(count) {}

  reference operator*() const { return *at_; }
  CountingIterator& operator++() {
    count_->before = count_->line;
    if (*at_++ == '\n') ++count_->line;
    return *this;
  }
  CountingIterator operator++(int) {
    CountingIterator old = *this;
    ++*this;
    return old;
  }
  bool operator==(const CountingIterator& other) const { return at_ == other.at_; }
  bool operator!=(const CountingIterator& other) const { return at_ != other.at_; }

 private:
  const char* at_;
  LineCount* count_;
};

/// Builds the tree from the events of nlohmann's parser.
class Builder final : public nlohmann::json_sax<nlohmann::json> {
 public:
  Builder(const std::string& name, const LineCount& count) : name_(name), count_(count) {}

  bool null() override { return add({.kind = JsonTree::Kind::null, .line = count_.line}); }
  bool boolean(bool value) override {
    return add({.kind = JsonTree::Kind::boolean, .line = count_.line, .truth = value});
  }
  bool number_integer(number_integer_t value) override { return add_number(static_cast<double>(value)); }
  bool number_unsigned(number_unsigned_t value) override { return add_number(static_cast<double>(value)); }
  bool number_float(number_float_t value, const string_t&) override { return add_number(value); }
  bool string(string_t& value) override {
    return add({.kind = JsonTree::Kind::text, .line = count_.line, .text = std::move(value)});
  }
  bool binary(binary_t&) override { return false; }  // text has no binary values
  bool start_object(std::size_t) override { return open(JsonTree::Kind::object); }
  bool start_array(std::size_t) override { return open(JsonTree::Kind::list); }
  bool end_object() override {
    require_different_keys(open_.back().items);
    return close();
  }
  bool end_array() override { return close(); }

  bool key(string_t& value) override {
    open_.back().items.push_back({.key = std::move(value), .key_line = count_.line});
    return true;
  }

  bool parse_error(std::size_t, const std::string& token, const nlohmann::detail::exception& error) override {
    const std::string where = name_ + ":" + std::to_string(count_.before) + ": ";
    if (error.id == 406) throw InputError(where + "the number " + printable(token) + " is too large");
    std::string what = error.what();  // for example "[json...] parse error at line 3, column 5: syntax error while ..."
    if (const auto begin = what.find(": "); begin != std::string::npos) what.erase(0, begin + 2);
    throw InputError(where + "no JSON: " + printable(what));
  }

  JsonTree take() { return std::move(root_); }

 private:
  /// Adds a number. The lexer has already taken the byte behind it, which may have begun a new line.
  bool add_number(double value) {
    return add({.kind = JsonTree::Kind::number, .line = count_.before, .number = value});
  }
  bool add(JsonTree value) {
    if (open_.empty()) {
      root_ = std::move(value);
    } else if (open_.back().kind == JsonTree::Kind::list) {
      open_.back().items.push_back(std::move(value));
    } else {
      JsonTree& member = open_.back().items.back();
      value.key = std::move(member.key);
      value.key_line = member.key_line;
      member = std::move(value);
    }
    return true;
  }
  bool open(JsonTree::Kind kind) {
    require(open_.size() < kDeepest, name_ + ":" + std::to_string(count_.line) + ": lists and objects lie more than " +
                                         std::to_string(kDeepest) + " deep in each other");
    open_.push_back({.kind = kind, .line = count_.line});
    return true;
  }
  void require_different_keys(const std::vector<JsonTree>& members) const {
    std::vector<const JsonTree*> sorted;
    for (const JsonTree& member : members) sorted.push_back(&member);
    std::sort(sorted.begin(), sorted.end(), [](const auto* a, const auto* b) {
      return std::tie(a->key, a->key_line) < std::tie(b->key, b->key_line);
    });
    const auto twice =
        std::adjacent_find(sorted.begin(), sorted.end(), [](const auto* a, const auto* b) { return a->key == b->key; });
    if (twice == sorted.end()) return;
    throw InputError(name_ + ":" + std::to_string(twice[1]->key_line) + ": the key \"" + printable(twice[1]->key) +
                     "\" a second time; the first is in line " + std::to_string(twice[0]->key_line));
  }
  bool close() {
    JsonTree value = std::move(open_.back());
    open_.pop_back();
    return add(std::move(value));
  }

  const std::string& name_;
  const LineCount& count_;
  std::vector<JsonTree> open_;
  JsonTree root_;
};

}  // namespace

const char* name_of(JsonTree::Kind kind) {
  constexpr const char* kNames[] = {"null", "true or false", "a number", "a text", "a list", "an object"};
  return kNames[static_cast<int>(kind)];
}

std::string printable(std::string_view text) {
  std::string result(text.substr(0, kLongestQuote));
  for (char& c : result) {
    if (c < ' ' || c > '~') c = '?';
  }
  return text.size() > kLongestQuote ? result + "..." : result;
}

JsonTree parse_json(std::string_view bytes, const std::string& name) {
  LineCount count;
  Builder builder(name, count);
  const char* const begin = bytes.data();
  nlohmann::json::sax_parse(CountingIterator(begin, &count), CountingIterator(begin + bytes.size(), &count), &builder);
  return builder.take();
}

JsonTree read_json(const std::filesystem::path& path, const std::string& kind, std::size_t most_bytes) {
  std::error_code error;
  require(!std::filesystem::is_directory(path, error), kind + " is a file, " + path.string() + " is a folder");
  std::ifstream file = opened(path);
  std::string bytes(most_bytes + 1, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  require(!file.bad(), "cannot be read to its end, " + path.string());
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  require(bytes.size() <= most_bytes, "more than " + std::to_string(most_bytes) + " bytes, " + path.string() + "; " +
                                          kind + " is JSON of at most that many");
  return parse_json(bytes, path.string());
}

}  // namespace tetwarp
