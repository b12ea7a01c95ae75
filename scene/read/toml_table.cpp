#include "scene/read/toml_table-inl.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <optional>

#include "scene/files/files.h"
#include "scene/read/variation.h"

namespace porthos::scene {
void toml_gave_up(const char* asserted) { throw TomlAssertion(asserted); }

Table::Content Table::content(const char* key) const {
  const std::string name = text(key, "the name of a file");
  if (name.empty()) fail(key, "is empty, expected the name of a file");
  Content c{(std::filesystem::path(file_.path).parent_path() / name).string(), {}};
  const auto stored = file_.kept ? file_.kept->find(name) : InputFiles::const_iterator{};
  if (file_.kept && stored != file_.kept->end())
    c.text = stored->second;
  else
    at_line(at(key), [&] { c.text = read_file(c.path); });
  if (file_.inputs) (*file_.inputs)[name] = c.text;
  return c;
}

toml::table parse_toml(std::string_view text, const File& file) {
  try {
    return toml::parse(text, std::string_view(file.path));
  } catch (const toml::parse_error& e) {
    const size_t first = text.find_first_not_of(" \t\r\n");
    if (first != text.npos && text[first] == '<')
      throw InvalidArgument(fmt::format(
          "{} is a model, expected a scene: porthos new {} writes one", file.path, file.path));
    std::string why(e.description());
    if (why.starts_with("Error ")) why.erase(0, 6);
    if (why.find("parsing boolean") != why.npos)
      why += "; a text stands in quotes, as in \"fixed\"";
    refuse(file.at(e.source()), "broken TOML " + why);
  } catch (const TomlAssertion& e) {
    refuse(file.path + ":1:1", fmt::format("broken TOML, the reader gave up at: {}", e.what()));
  }
}

std::string joined(const Names& names) { return fmt::format("{}", fmt::join(names, ", ")); }

std::string types_of(const std::string& id) {
  std::vector<std::string> types;
  for (const SchemaTable& t : schema())
    if (t.id.rfind(id + ".", 0) == 0) types.push_back("\"" + t.id.substr(id.size() + 1) + "\"");
  const std::string last = types.back();
  types.pop_back();
  return fmt::format("{} or {}", fmt::join(types, ", "), last);
}

std::string found(const toml::node& n) {
  switch (n.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "an array";
    case toml::node_type::string:
      return "a string";
    case toml::node_type::boolean:
      return "a boolean";
    case toml::node_type::date:
      return "a date";
    case toml::node_type::time:
      return "a time of day";
    case toml::node_type::date_time:
      return "a date and time";
    default:
      return "a number";
  }
}

void refuse(const std::string& where, const std::string& sentence) {
  throw InvalidArgument(where + ": " + sentence);
}

/// "element[0] (dry_friction, shoulder), element[1] (...)" with the words that tell tables apart.
static std::string listed_places(const toml::array& array, const std::string& name) {
  std::string places;
  for (size_t i = 0; i < array.size(); ++i) {
    std::string words;
    if (const toml::table* t = array.get(i)->as_table())
      for (const char* key : {"type", "name", "joint", "link"})
        if (const auto word = t->get_as<std::string>(key)) add_to_list(words, word->get());
    add_to_list(places, fmt::format("{}[{}]{}", name, i, words.empty() ? "" : " (" + words + ")"));
  }
  return places;
}

namespace {

/// A part of a key: a name, and the place in the array of this name.
struct KeyPart {
  std::string name;
  std::optional<size_t> place = {};
  size_t end = 0;  ///< in the key, behind the part
};

/// Where the name ends that begins in a key at `from`, in a table of tables or numbers by name:
/// names of links and joints of a robot have dots, "target.hinge". Behind that of a table a key of
/// it is known; the longest such name counts.
size_t end_of_name(const std::string& key, size_t from, const std::string& table) {
  bool by_name = false;
  Names inner;
  for (const SchemaTable& t : schema())
    for (const SchemaKey& k : t.keys) {
      if (k.kind != SchemaKey::Kind::named || k.name != table) continue;
      if (k.count == 1) return key.size();
      by_name = true;
      for (const SchemaKey& known : schema_of(k.table)->keys) inner.push_back(known.name);
    }
  const size_t first = std::min(key.find('.', from), key.size());
  if (!by_name || first == key.size()) return first;
  for (size_t dot = key.rfind('.'); dot > from; dot = key.rfind('.', dot - 1)) {
    const auto next = std::string_view(key).substr(dot + 1);
    if (std::ranges::count(inner, next.substr(0, next.find_first_of(".["))) > 0) return dot;
    if (dot == first) break;
  }
  return key.rfind('.');
}

/// Takes the place in brackets off the name of a part.
void take_place(KeyPart& part) {
  std::string& name = part.name;
  const size_t open = name.find('[');
  if (open == name.npos || name.back() != ']') return;
  size_t n = 0;
  const char *const first = name.data() + open + 1, *const last = name.data() + name.size() - 1;
  const auto [rest, error] = std::from_chars(first, last, n);
  if (error != std::errc() || rest != last)
    throw std::string("expected a whole number in the brackets, from 0");
  part.place = n;
  name.resize(open);
}

/// The parts of a key. A part in quotes may hold any letters. @throws std::string: why it has none
std::vector<KeyPart> parts_of(const std::string& key) {
  std::vector<KeyPart> parts;
  for (size_t begin = 0; begin <= key.size(); begin = parts.back().end + 1) {
    KeyPart part;
    if (const char q = begin < key.size() ? key[begin] : '.'; q == '"' || q == '\'') {
      const size_t close = key.find(q, begin + 1);
      if (close == key.npos) throw std::string("expected a second quote");
      part.name = key.substr(begin + 1, close - begin - 1);
      part.end = close + 1;
      if (part.end < key.size() && key[part.end] != '.')
        throw std::string("expected a dot behind the second quote");
    } else {
      part.end = end_of_name(key, begin, parts.empty() ? "" : parts.back().name);
      part.name = key.substr(begin, part.end - begin);
      take_place(part);
    }
    if (part.name.empty()) throw std::string("expected tables and keys with dots between them");
    parts.push_back(std::move(part));
  }
  return parts;
}

}  // namespace

std::optional<double> number_at(const toml::table& root, const std::string& key) {
  const toml::node* at = &root;
  try {
    for (const KeyPart& part : parts_of(key)) {
      at = at && at->is_table() ? at->as_table()->get(part.name) : nullptr;
      if (at && part.place) at = at->is_array() ? at->as_array()->get(*part.place) : nullptr;
    }
  } catch (const std::string&) {
    return {};
  }
  return at ? at->value<double>() : std::nullopt;
}

void replace(toml::table& root, const std::string& key, const std::vector<double>& values) {
  const auto nowhere = [&](const std::string& why) {
    throw InvalidArgument(fmt::format("there is no '{}' in the scene: {}", key, why));
  };
  toml::array numbers;
  for (const double v : values) numbers.push_back(v);
  std::vector<KeyPart> parts;
  try {
    parts = parts_of(key);
  } catch (const std::string& why) {
    nowhere(why);
  }
  toml::node* at = &root;
  size_t before = 0;  // the end of the part before
  for (const KeyPart& part : parts) {
    const auto& [name, place, end] = part;
    toml::table* table = at->as_table();
    if (at->is_array() && before > 0)
      nowhere("expected one of " + listed_places(*at->as_array(), key.substr(0, before)));
    if (!table) nowhere("expected tables and keys with dots between them");
    before = end;
    if (&part == &parts.back() && !place) {
      if (values.size() == 1)
        table->insert_or_assign(name, values[0]);
      else
        table->insert_or_assign(name, numbers);
      return;
    }
    if (!table->contains(name)) {
      if (place)  // a vector left at its default
        table->insert(name, toml::array{0.0, 0.0, 0.0});
      else
        table->insert(name, toml::table{});
    }
    at = table->get(name);
    if (!place) continue;
    toml::array* array = at->as_array();
    if (!array) nowhere(fmt::format("'{}' is {}, expected an array", name, found(*at)));
    if (*place >= array->size())
      nowhere(fmt::format("'{}' has the places 0 to {}", name, int(array->size()) - 1));
    if (&part == &parts.back()) {
      array->replace(array->cbegin() + long(*place), values[0]);
      return;
    }
    at = array->get(*place);
  }
}

bool is_of_start(const std::string& key) { return key.rfind("initial.", 0) == 0; }

void check_seconds(const char* name, double seconds, const std::string& where) {
  if (!std::isfinite(seconds))
    refuse(where, fmt::format("{} is {}, expected a finite number of seconds", name, seconds));
  if (seconds <= 0) refuse(where, fmt::format("{} is {} s, expected more than 0 s", name, seconds));
}

}  // namespace porthos::scene
