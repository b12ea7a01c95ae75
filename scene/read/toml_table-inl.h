#pragma once
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mechanics/mechanism.h"
#include "scene/read/schema.h"
#include "scene/read/toml_file-inl.h"

/// Reading TOML: every error message names file, line, column, key, what was found and what was
/// expected. Private to the readers of a scene.
namespace porthos::scene {

using mechanics::Vec3d;

/// Reads typed values. Keys, units, words and defaults are those of the table's schema. Every error
/// message names file, line, column, key, what was found and what was expected.
class Table {
 public:
  /// @param label   the table's name in messages: "[run]"
  /// @param prefix  goes before the keys in messages: "base."
  Table(const File& file, const toml::table& t, std::string label, std::string prefix,
        const SchemaTable& schema)
      : Table(file, t, std::move(label), std::move(prefix), names_of(schema)) {
    schema_ = &schema;
  }
  /// A table whose keys are names chosen by the user.
  Table(const File& file, const toml::table& t, std::string label, std::string prefix, Names known)
      : file_(file),
        t_(t),
        label_(std::move(label)),
        prefix_(std::move(prefix)),
        known_(std::move(known)) {
    for (const auto& [key, value] : t_) check_known(key);
  }

  bool has(const char* key) const { return t_.contains(key); }
  /// Place of a key's value and the key itself; for a missing key, the place of its table.
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
           fmt::format("{} lacks the key '{}', expected {}", label_, key, expected));
  }
  void require(const char* key, const std::string& expected) const {
    if (!has(key)) missing(key, expected);
  }

  std::string text(const char* key, const std::string& expected) const {
    require(key, expected);
    const toml::node& n = node(key);
    if (!n.is_string()) fail(key, fmt::format("is {}, expected {}", found(n), expected));
    return **n.as_string();
  }
  bool boolean(const char* key) const {
    if (!has(key)) return default_of(key, "true or false") == "true";
    const toml::node& n = node(key);
    if (!n.is_boolean()) fail(key, fmt::format("is {}, expected true or false", found(n)));
    return **n.as_boolean();
  }
  /// One of the words of the schema.
  std::string choice(const char* key) const {
    const auto& words = of(key).words;
    if (has(key)) return choice(key, words);
    const std::string otherwise = default_of(key, alternatives(words));
    return otherwise.substr(1, otherwise.size() - 2);  // without its quotes
  }
  /// One of `words`, in a table without a schema.
  std::string choice(const char* key, const std::vector<std::string>& words) const {
    const std::string word = text(key, alternatives(words));
    if (std::find(words.begin(), words.end(), word) == words.end())
      fail(key, fmt::format("is \"{}\", expected {}", word, alternatives(words)));
    return word;
  }
  /// A number; if the key is missing, the default of the schema if that is a number.
  double number(const char* key) const {
    const std::string unit = of_unit(of(key));
    if (has(key)) return number(key, unit);
    return as_number(default_of(key, "a number" + unit)).value();
  }
  double number_or(const char* key, double otherwise) const {
    return has(key) ? number(key) : otherwise;
  }
  double not_negative(const char* key) const {
    const double x = number(key);
    if (x < 0) fail(key, fmt::format("is {}, expected a number{}, 0 or more", x, of_unit(of(key))));
    return x;
  }
  double positive(const char* key) const { return above_0(key, number(key)); }
  double positive_or(const char* key, double otherwise) const {
    return above_0(key, number_or(key, otherwise));
  }
  /// A number in another unit than the schema's, for signals. @param unit " of seconds", or empty
  double number(const char* key, const std::string& unit) const {
    if (!has(key)) missing(key, fmt::format("a number{}", unit));
    return finite(node(key), prefix_ + key, unit);
  }
  double seconds(const char* key) const {
    const double x = number(key);
    check_seconds((prefix_ + key).c_str(), x, at(key));
    return x;
  }
  std::uint64_t whole(const char* key) const {
    if (!has(key)) return std::uint64_t(as_number(default_of(key, "a whole number")).value());
    const toml::node& n = node(key);
    const std::string expected = "expected a whole number, 0 or more";
    if (!n.is_number()) fail(key, fmt::format("is {}, {}", found(n), expected));
    if (!n.is_integer() || **n.as_integer() < 0)
      fail(key, fmt::format("is {}, {}", *n.value<double>(), expected));
    return static_cast<std::uint64_t>(**n.as_integer());
  }
  template <size_t count>
  std::array<double, count> numbers(const char* key) const {
    return numbers<count>(key, of_unit(of(key)));
  }
  /// @param what  meaning of the numbers, instead of the schema's unit: " p1, p2, p3"
  template <size_t count>
  std::array<double, count> numbers(const char* key, const std::string& what) const {
    const std::string several = fmt::format("{} numbers{}", count, what);
    if (!has(key)) missing(key, several);
    const toml::node& n = node(key);
    if (!n.is_array()) fail(key, fmt::format("is {}, expected {}", found(n), several));
    const toml::array& a = *n.as_array();
    if (a.size() != count)
      fail(key, fmt::format("has {} {}, expected {}", a.size(), a.size() == 1 ? "entry" : "entries",
                            several));
    std::array<double, count> x{};
    for (size_t i = 0; i < count; ++i)
      x[i] = finite(a[i], fmt::format("{}{}[{}]", prefix_, key, i), what);
    return x;
  }
  /// Three numbers; if the key is missing, the default of the schema if that is "[x, y, z]".
  Vec3d vector(const char* key) const {
    Vec3d v{0, 0, 0};
    if (has(key)) {
      const auto x = numbers<3>(key);
      return {x[0], x[1], x[2]};
    }
    const std::string otherwise = default_of(key, "3 numbers" + of_unit(of(key)));
    std::sscanf(otherwise.c_str(), "[%lf, %lf, %lf]", &v.x, &v.y, &v.z);
    return v;
  }
  /// A vector of length 1.
  Vec3d direction(const char* key) const {
    const Vec3d d = vector(key);
    const double length = mechanics::norm(d);
    if (!(length > 0)) fail(key, "has length 0, expected a direction");
    return (1 / length) * d;
  }
  /// An array of numbers of any length.
  std::vector<double> list(const char* key) const { return list(key, of_unit(of(key))); }
  std::vector<double> list(const char* key, const std::string& unit) const {
    if (!has(key)) missing(key, "an array of numbers" + unit);
    const toml::node& n = node(key);
    if (!n.is_array())
      fail(key, fmt::format("is {}, expected an array of numbers{}", found(n), unit));
    std::vector<double> x;
    for (size_t i = 0; i < n.as_array()->size(); ++i)
      x.push_back(finite((*n.as_array())[i], fmt::format("{}{}[{}]", prefix_, key, i), unit));
    return x;
  }
  /// An array of rows of n numbers, of any length.
  template <size_t n>
  std::vector<std::array<double, n>> rows(const char* key) const {
    const std::string unit = of_unit(of(key)),
                      expected = fmt::format("an array of rows of {} numbers{}", n, unit);
    const toml::node& all = node(key);
    if (!all.is_array()) fail(key, fmt::format("is {}, expected {}", found(all), expected));
    std::vector<std::array<double, n>> list;
    for (const toml::node& each : *all.as_array()) {
      const std::string name = fmt::format("{}{}[{}]", prefix_, key, list.size());
      const toml::array* row = each.as_array();
      if (!row || row->size() != n)
        refuse(file_.at(each.source()),
               fmt::format("{} is {}, expected {} numbers", name, found(each), n));
      auto& numbers = list.emplace_back();
      for (size_t i = 0; i < n; ++i)
        numbers[i] = finite((*row)[i], fmt::format("{}[{}]", name, i), unit);
    }
    return list;
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
  /// Path and content of the file that a key names, searched beside the scene. The scene keeps it.
  struct Content {
    std::string path, text;
  };
  Content content(const char* key) const;
  bool of_results() const { return file_.of_results; }
  bool is_array(const char* key) const { return has(key) && node(key).is_array(); }
  bool is_number(const char* key) const { return has(key) && node(key).is_number(); }
  std::string found_at(const char* key) const { return found(node(key)); }

  /// The keys of this table, in alphabetical order.
  std::string where() const { return file_.at(t_.source()); }
  const std::string& label() const { return label_; }

  const toml::table& raw(const char* key, const std::string& expected) const {
    const toml::node& n = node(key);
    if (!n.is_table()) fail(key, fmt::format("is {}, expected {}", found(n), expected));
    return *n.as_table();
  }
  /// A table inside this one: [initial] base -> keys are called base.position, ...
  Table table(const char* key) const {
    const SchemaTable& inner = *schema_of(of(key).table);
    return {file_, raw(key, "a table with the keys " + joined(names_of(inner))), prefix_ + key,
            prefix_ + key + ".", inner};
  }
  Table table(const char* key, Names known) const {
    const auto& inner = raw(key, "a table with the keys " + joined(known));
    return {file_, inner, prefix_ + key, prefix_ + key + ".", std::move(known)};
  }
  /// One of the tables of a file: [run], with keys that have no prefix.
  Table section(const char* key) const {
    const SchemaTable& inner = *schema_of(of(key).table);
    const std::string expected = "a table with the keys " + joined(names_of(inner));
    if (!has(key))
      refuse(file_.path + ":1:1", fmt::format("there is no [{}], expected {}", key, expected));
    return {file_, raw(key, expected), fmt::format("[{}]", key), "", inner};
  }
  /// Calls f(word, table) for each [[key]]. The word is the value of its key `by`: a name, or one
  /// of the types that have their own tables in the schema.
  template <class F>
  void each_of(const char* key, const char* by, F f) const {
    if (!has(key)) return;
    const toml::node& n = node(key);
    if (!n.is_array_of_tables())
      fail(key, fmt::format("is {}, expected tables [[{}]]", found(n), key));
    for (const toml::node& each : *n.as_array()) {
      const toml::table& t = *each.as_table();
      const std::string label = fmt::format("[[{}]]", key);
      const toml::node* type = t.get(by);
      if (!type)
        refuse(file_.at(t.source()), fmt::format("{} lacks the key '{}', expected one", label, by));
      if (!type->is_string())
        refuse(file_.at(type->source()),
               fmt::format("{} is {}, expected a word", by, found(*type)));
      const std::string word = **type->as_string(), &id = of(key).table;
      const SchemaTable* inner = schema_of(id);
      if (!inner) inner = schema_of(id + "." + word);
      if (!inner)
        refuse(file_.at(type->source()),
               fmt::format("{} is \"{}\", expected {}", by, word, types_of(id)));
      f(word, Table(file_, t, label, "", *inner));
    }
  }
  /// Calls f(name, where, table) for each name, chosen by the user, in the table `key`.
  template <class F>
  void each(const char* key, F f) const {
    if (!has(key)) return;
    const SchemaTable& inner = *schema_of(of(key).table);
    for (const auto& [name, node] : raw(key, "a table of tables by name")) {
      const std::string full = fmt::format("{}{}.{}", prefix_, key, name.str());
      const std::string where = file_.at(name.source());
      if (!node.is_table())
        refuse(file_.at(node.source()), fmt::format("{} is {}, expected a table with the keys {}",
                                                    full, found(node), joined(names_of(inner))));
      refuse_own_keys(*node.as_table(), full, names_of(inner));
      f(std::string(name.str()), where, Table(file_, *node.as_table(), full, full + ".", inner));
    }
  }

 private:
  const SchemaKey& of(const char* key) const { return schema_->key(key); }
  static Names names_of(const SchemaTable& t) {
    Names names;
    for (const SchemaKey& k : t.keys) names.push_back(k.name);
    return names;
  }
  /// The default of a missing key; throws if there is none.
  std::string default_of(const char* key, const std::string& expected) const {
    const std::string& otherwise = of(key).otherwise;
    const bool word = otherwise == "true" || otherwise == "false" || otherwise.starts_with('"');
    if (!word && !otherwise.starts_with('[') && !as_number(otherwise)) missing(key, expected);
    return otherwise;
  }
  static std::string alternatives(const std::vector<std::string>& words) {
    return fmt::format("\"{}\"", fmt::join(words, "\" or \""));
  }
  double above_0(const char* key, double x) const {
    if (!(x > 0)) fail(key, fmt::format("is {}, expected a number{} above 0", x, of_unit(of(key))));
    return x;
  }
  /// A key of this table that stands in a table inside it.
  void refuse_own_keys(const toml::table& t, const std::string& name, const Names& known) const {
    for (const auto& [key, value] : t)
      if (std::ranges::count(known_, key.str()) > 0 && std::ranges::count(known, key.str()) == 0)
        refuse(file_.at(key.source()), fmt::format("unknown key '{}' in {}, expected it in {} "
                                                   "itself (known: {})",
                                                   key.str(), name, label_, joined(known)));
  }
  void check_known(const toml::key& key) const {
    if (std::find(known_.begin(), known_.end(), key.str()) != known_.end()) return;
    refuse(file_.at(key.source()),
           fmt::format("unknown key '{}' in {}, the nearest known one is '{}' (known: {})",
                       key.str(), label_, nearest(key.str(), known_), joined(known_)));
  }
  /// The value of a key; throws if the key is missing.
  const toml::node& node(const char* key) const {
    const toml::node* n = t_.get(key);
    if (!n) missing(key, "one");
    return *n;
  }
  double finite(const toml::node& n, const std::string& name, const std::string& unit) const {
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
  const SchemaTable* schema_ = nullptr;
};

}  // namespace porthos::scene
