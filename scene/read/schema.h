#pragma once
#include <string>
#include <vector>

/// The keys of a scene file as data. The readers take the keys, units, words and defaults of a
/// table from here, and so do the JSON schema for editors and docs/scene_reference.md.
namespace porthos::scene {

/// One key of a table.
struct SchemaKey {
  enum class Kind {
    text,
    word,
    boolean,
    number,
    whole,
    numbers,
    axes,
    list,
    rows,
    texts,
    table,
    tables,
    named,
    any
  };
  std::string name;
  Kind kind;
  std::string unit;       ///< "s", "rad or m", "" without a unit
  std::string otherwise;  ///< the default as text; "required" if there is none
  std::string what;       ///< a description of one line
  std::vector<std::string> words =
      {};  ///< of a word: the allowed ones; of a number: words that stand for a number
  int count =
      0;  ///< how many numbers, of rows in each; 1 for named: numbers by name instead of tables
  std::string table = {};  ///< of a table, of tables and of named tables: the id of the table
};

/// A table, or one of several that a word selects: [[element]] by its type.
struct SchemaTable {
  std::string id;       ///< "integrator", "initial.base", "element.spring"
  std::string heading;  ///< "[integrator]", "[[element]] type = \"spring\""
  std::string what;
  std::vector<SchemaKey> keys;

  /// @throws std::logic_error if there is none: a reader asked for an undeclared key
  const SchemaKey& key(const std::string& name) const;
};

/// All tables. The first, "scene", holds the tables of the file.
const std::vector<SchemaTable>& schema();

/// The table with an id, or null.
const SchemaTable* schema_of(const std::string& id);

/// The unit of a key as used in messages: " of N m/rad or N/m"; empty without a unit.
std::string of_unit(const SchemaKey& key);

/// A JSON schema (draft 7) of scene files.
std::string schema_json();

/// docs/scene_reference.md.
std::string schema_markdown();

}  // namespace porthos::scene
