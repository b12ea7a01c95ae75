#pragma once
#include <string>
#include <vector>

/// What may stand in a scene file, as data: the JSON schema for editors, and
/// docs/scene_reference.md. That it says what the reader says is tested key by key
/// (tests/scene/schema_test.cpp).
namespace porthos::scene {

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
};

/// "scene" is the first: the tables of the file.
const std::vector<SchemaTable>& schema();

/// A JSON schema (draft 7) of scene files.
std::string schema_json();

/// docs/scene_reference.md.
std::string schema_markdown();

}  // namespace porthos::scene
