#include "scene/read/toml_table-inl.h"

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

void replace(toml::table& root, const std::string& key, const std::vector<double>& values) {
  const auto nowhere = [&](const std::string& why) {
    throw InvalidArgument(fmt::format("there is no '{}' in the scene: {}", key, why));
  };
  static const std::string of_joints = "initial.joints.";
  toml::array numbers;
  for (const double v : values) numbers.push_back(v);
  toml::node* at = &root;
  for (size_t begin = 0; begin <= key.size();) {
    // The name of a robot's joint has dots: "initial.joints.target.hinge.velocity".
    const bool joint = begin == of_joints.size() && key.starts_with(of_joints);
    const size_t dot = joint ? key.rfind('.') : begin;
    const size_t end = dot > begin ? dot : std::min(key.find('.', begin), key.size());
    std::string name = key.substr(begin, end - begin);
    std::optional<size_t> place;
    if (const size_t open = name.find('['); open != std::string::npos && name.back() == ']') {
      size_t n = 0;
      const char *const first = name.data() + open + 1, *const last = name.data() + name.size() - 1;
      const auto [rest, error] = std::from_chars(first, last, n);
      if (error != std::errc() || rest != last)
        nowhere("expected a whole number in the brackets, from 0");
      place = n;
      name.resize(open);
    }
    toml::table* table = at->as_table();
    if (at->is_array() && begin > 0)
      nowhere("expected one of " + listed_places(*at->as_array(), key.substr(0, begin - 1)));
    if (!table || name.empty()) nowhere("expected tables and keys with dots between them");
    const bool whole = end == key.size() && !place;
    if (whole && values.size() == 1) {
      table->insert_or_assign(name, values[0]);
      return;
    }
    if (whole) {
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
    if (place) {
      toml::array* array = at->as_array();
      if (!array) nowhere(fmt::format("'{}' is {}, expected an array", name, found(*at)));
      if (*place >= array->size())
        nowhere(fmt::format("'{}' has the places 0 to {}", name, int(array->size()) - 1));
      if (end == key.size()) {
        array->replace(array->cbegin() + long(*place), values[0]);
        return;
      }
      at = array->get(*place);
    }
    begin = end + 1;
  }
}

bool is_of_start(const std::string& key) { return key.rfind("initial.", 0) == 0; }

void check_seconds(const char* name, double seconds, const std::string& where) {
  if (!std::isfinite(seconds))
    refuse(where, fmt::format("{} is {}, expected a finite number of seconds", name, seconds));
  if (seconds <= 0) refuse(where, fmt::format("{} is {} s, expected more than 0 s", name, seconds));
}

}  // namespace porthos::scene
