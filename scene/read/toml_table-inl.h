#pragma once
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "mechanics/mechanism.h"
#include "phs/error.h"

/// Reading TOML: every refusal names file, line, column, key, what was found and what was expected.
/// Private to the readers of a scene.
namespace porthos::scene {

using mechanics::Vec3d;
using Names = std::vector<std::string_view>;

std::string joined(const Names& names);
/// The known name that takes the fewest edits from `name`.
std::string_view nearest(std::string_view name, const Names& known);
/// What stands in the file, for "expected ..." sentences.
std::string found(const toml::node& n);

/// where: "file:line:column", or "--step" of a command line
[[noreturn]] void refuse(const std::string& where, const std::string& sentence);
void check_seconds(const char* name, double seconds, const std::string& where);

struct File {
  std::string path;
  std::string at(const toml::source_region& r) const {
    return fmt::format("{}:{}:{}", path, std::max(r.begin.line, 1u), std::max(r.begin.column, 1u));
  }
};

/// Puts numbers in the place of those of a key, see variation.h. @throws InvalidArgument if it has
/// no place
void replace(toml::table& root, const std::string& key, const std::vector<double>& values);

/// Reads typed values; every refusal names file, line, column, key, what was found and what was
/// expected.
class Table {
 public:
  /// @param label   how people call it: "[run]"
  /// @param prefix  goes before the keys in messages: "base."
  Table(const File& file, const toml::table& t, std::string label, std::string prefix, Names known)
      : file_(file),
        t_(t),
        label_(std::move(label)),
        prefix_(std::move(prefix)),
        known_(std::move(known)) {
    for (const auto& [key, value] : t_) check_known(key);
  }

  bool has(const char* key) const { return t_.contains(key); }
  /// Where the value of a key stands, and the key itself; of one that is missing, its table.
  std::string at(const char* key) const {
    return has(key) ? file_.at(node(key).source()) : where();
  }
  std::string at_key(const char* key) const {
    return has(key) ? file_.at(t_.find(key)->first.source()) : where();
  }
  [[noreturn]] void fail(const char* key, const std::string& sentence) const {
    refuse(at(key), prefix_ + key + " " + sentence);
  }
  [[noreturn]] void missing(const char* key, const std::string& expected) const {
    refuse(file_.at(t_.source()),
           fmt::format("{} has no key '{}', expected {}", label_, key, expected));
  }
  void require(const char* key, const std::string& expected) const {
    if (!has(key)) missing(key, expected);
  }

  std::string text(const char* key, const std::string& expected) const {
    const toml::node& n = node(key);
    if (!n.is_string()) fail(key, fmt::format("is {}, expected {}", found(n), expected));
    return **n.as_string();
  }
  bool boolean(const char* key) const {
    const toml::node& n = node(key);
    if (!n.is_boolean()) fail(key, fmt::format("is {}, expected true or false", found(n)));
    return **n.as_boolean();
  }
  /// One of some words.
  std::string choice(const char* key, const Names& words) const {
    const std::string expected = fmt::format("\"{}\"", fmt::join(words, "\" or \""));
    const std::string word = text(key, expected);
    if (std::find(words.begin(), words.end(), word) == words.end())
      fail(key, fmt::format("is \"{}\", expected {}", word, expected));
    return word;
  }
  /// @param unit  " of seconds", or empty
  double number(const char* key, const char* unit) const {
    return finite(node(key), prefix_ + key, unit);
  }
  double required(const char* key, const char* unit) const {
    require(key, fmt::format("a number{}", unit));
    return number(key, unit);
  }
  double number_or(const char* key, const char* unit, double otherwise) const {
    return has(key) ? number(key, unit) : otherwise;
  }
  double not_negative_or(const char* key, const char* unit, double otherwise) const {
    const double x = number_or(key, unit, otherwise);
    if (x < 0) fail(key, fmt::format("is {}, expected a number{}, 0 or more", x, unit));
    return x;
  }
  double seconds(const char* key) const {
    const double x = number(key, " of seconds");
    check_seconds((prefix_ + key).c_str(), x, at(key));
    return x;
  }
  std::uint64_t whole(const char* key) const {
    const toml::node& n = node(key);
    const std::string expected = "expected a whole number, 0 or more";
    if (!n.is_number()) fail(key, fmt::format("is {}, {}", found(n), expected));
    if (!n.is_integer() || **n.as_integer() < 0)
      fail(key, fmt::format("is {}, {}", *n.value<double>(), expected));
    return static_cast<std::uint64_t>(**n.as_integer());
  }
  template <size_t count>
  std::array<double, count> numbers(const char* key, const char* unit) const {
    const toml::node& n = node(key);
    const std::string expected = fmt::format("expected {} numbers{}", count, unit);
    if (!n.is_array()) fail(key, fmt::format("is {}, {}", found(n), expected));
    const toml::array& a = *n.as_array();
    if (a.size() != count)
      fail(key,
           fmt::format("has {} {}, {}", a.size(), a.size() == 1 ? "entry" : "entries", expected));
    std::array<double, count> x{};
    for (size_t i = 0; i < count; ++i)
      x[i] = finite(a[i], fmt::format("{}{}[{}]", prefix_, key, i), unit);
    return x;
  }
  /// An array of numbers of any length.
  std::vector<double> list(const char* key, const char* unit) const {
    const toml::node& n = node(key);
    if (!n.is_array())
      fail(key, fmt::format("is {}, expected an array of numbers{}", found(n), unit));
    std::vector<double> x;
    for (size_t i = 0; i < n.as_array()->size(); ++i)
      x.push_back(finite((*n.as_array())[i], fmt::format("{}{}[{}]", prefix_, key, i), unit));
    return x;
  }
  /// An array of texts of any length.
  std::vector<std::string> texts(const char* key, const char* what) const {
    const toml::node& n = node(key);
    if (!n.is_array()) fail(key, fmt::format("is {}, expected an array of {}", found(n), what));
    std::vector<std::string> all;
    for (const toml::node& each : *n.as_array()) {
      if (!each.is_string())
        refuse(file_.at(each.source()),
               fmt::format("{}{}[{}] is {}, expected text", prefix_, key, all.size(), found(each)));
      all.push_back(**each.as_string());
    }
    return all;
  }
  bool is_array(const char* key) const { return has(key) && node(key).is_array(); }
  bool is_number(const char* key) const { return has(key) && node(key).is_number(); }
  std::string found_at(const char* key) const { return found(node(key)); }
  Vec3d vector_or_zero(const char* key, const char* unit) const {
    if (!has(key)) return {0, 0, 0};
    const auto x = numbers<3>(key, unit);
    return {x[0], x[1], x[2]};
  }

  /// The keys of this table, in the order of the file's alphabet.
  std::string where() const { return file_.at(t_.source()); }
  const std::string& label() const { return label_; }

  const toml::table& raw(const char* key, const std::string& expected) const {
    const toml::node& n = node(key);
    if (!n.is_table()) fail(key, fmt::format("is {}, expected {}", found(n), expected));
    return *n.as_table();
  }
  /// A table inside this one: [initial] base -> keys are called base.position, ...
  Table table(const char* key, Names known) const {
    const auto& inner = raw(key, "a table with the keys " + joined(known));
    return {file_, inner, prefix_ + key, prefix_ + key + ".", std::move(known)};
  }
  /// Calls f(table) for each [[key]], whose keys are known once its text `by` is: known(type).
  template <class Known, class F>
  void each_of(const char* key, const char* by, Known known, F f) const {
    if (!has(key)) return;
    const toml::node& n = node(key);
    if (!n.is_array_of_tables())
      fail(key, fmt::format("is {}, expected tables [[{}]]", found(n), key));
    for (const toml::node& each : *n.as_array()) {
      const toml::table& t = *each.as_table();
      const std::string label = fmt::format("[[{}]]", key);
      const toml::node* type = t.get(by);
      if (!type)
        refuse(file_.at(t.source()), fmt::format("{} has no key '{}', expected one", label, by));
      if (!type->is_string())
        refuse(file_.at(type->source()),
               fmt::format("{} is {}, expected a word", by, found(*type)));
      const std::string word = **type->as_string();
      f(word, Table(file_, t, label, "", known(word, file_.at(type->source()))));
    }
  }
  /// Calls f(name, where, table) for each of the user's own names in the table `key`.
  template <class F>
  void each(const char* key, const Names& known, F f) const {
    if (!has(key)) return;
    for (const auto& [name, node] : raw(key, "a table of tables by name")) {
      const std::string full = fmt::format("{}{}.{}", prefix_, key, name.str());
      const std::string where = file_.at(name.source());
      if (!node.is_table())
        refuse(file_.at(node.source()), fmt::format("{} is {}, expected a table with the keys {}",
                                                    full, found(node), joined(known)));
      f(std::string(name.str()), where, Table(file_, *node.as_table(), full, full + ".", known));
    }
  }

 private:
  void check_known(const toml::key& key) const {
    if (std::find(known_.begin(), known_.end(), key.str()) != known_.end()) return;
    refuse(file_.at(key.source()),
           fmt::format("unknown key '{}' in {}, the nearest known one is '{}' (known: {})",
                       key.str(), label_, nearest(key.str(), known_), joined(known_)));
  }
  /// The value of a key; one that is missing is refused.
  const toml::node& node(const char* key) const {
    const toml::node* n = t_.get(key);
    if (!n) missing(key, "one");
    return *n;
  }
  double finite(const toml::node& n, const std::string& name, const char* unit) const {
    if (!n.is_number())
      refuse(file_.at(n.source()),
             fmt::format("{} is {}, expected a number{}", name, found(n), unit));
    const double x = *n.value<double>();
    if (!std::isfinite(x))
      refuse(file_.at(n.source()),
             fmt::format("{} is {}, expected a finite number{}", name, x, unit));
    return x;
  }

  const File& file_;
  const toml::table& t_;
  std::string label_, prefix_;
  Names known_;
};

}  // namespace porthos::scene
