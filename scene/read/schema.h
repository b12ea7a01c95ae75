#pragma once
#include <string>
#include <vector>

/// What may stand in a scene file, as data: the readers take the keys, units, words and defaults of
/// a table from here, and so do the JSON schema for editors and docs/scene_reference.md.
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
    texts,
    table,
    tables,
    named
  };
  std::string name;
  Kind kind;
  std::string unit;       ///< "s", "rad or m", "" without one
  std::string otherwise;  ///< the default as text; "required" if there is none
  std::string what;       ///< one line for people
  std::vector<std::string> words =
      {};                  ///< of a word: those there are; of a number: words that stand for one
  int count = 0;           ///< of numbers; 1 of named: numbers by name instead of tables
  std::string table = {};  ///< of a table, of tables and of named tables: which, by id
};

/// A table, or one of several a word chooses: [[element]] by its type.
struct SchemaTable {
  std::string id;       ///< "integrator", "initial.base", "element.spring"
  std::string heading;  ///< "[integrator]", "[[element]] type = \"spring\""
  std::string what;
  std::vector<SchemaKey> keys;

  /// @throws std::logic_error if there is none: a reader asks for what it has not declared
  const SchemaKey& key(const std::string& name) const;
};

/// "scene" is the first: the tables of the file.
const std::vector<SchemaTable>& schema();

/// The table with an id, or null.
const SchemaTable* schema_of(const std::string& id);

/// The unit of a key as messages say it: " of N m/rad or N/m"; empty without one.
std::string of_unit(const SchemaKey& key);

/// A JSON schema (draft 7) of scene files.
std::string schema_json();

/// docs/scene_reference.md.
std::string schema_markdown();

}  // namespace porthos::scene
