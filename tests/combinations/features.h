#pragma once
#include <string>
#include <utility>
#include <vector>

/// The features of a scene, each as what it adds to one, and which pairs of them are refused and
/// why.
namespace porthos::test::combinations {

/// {"table.key", value as TOML}
using Settings = std::vector<std::pair<std::string, std::string>>;

/// How a pair is run: the features of a scene by `porthos verify`, the others with the scene of
/// their partner.
enum class Mode { verify, resume, ensemble, compare, report, python };

struct Feature {
  std::string name;                ///< in the page
  std::vector<std::string> words;  ///< one of them is in every sentence that refuses it
  Settings sets = {};              ///< what it is
  Settings needs = {};             ///< what it stands on; gives way to what the other one sets
  /// Tables of its own. In a pair @ is 1 in the first and 2 in the second, and so are joint@ and
  /// the time 0.@
  std::string tables = {};
  std::string links = {};  ///< of the model, @ likewise
  Mode mode = Mode::verify;
};
const std::vector<Feature>& features();
/// @throws std::out_of_range
const Feature& feature(const std::string& name);

/// Settings that exclude each other are no pair: two values of one key.
bool alternatives(const Feature& a, const Feature& b);

/// Pairs of any of the one with any of the other cannot be, or are not built, as the reason says.
struct Refusal {
  std::vector<std::string> of, with;
  std::string reason;
  bool by_method = false;  ///< what the method is not made for
};
const std::vector<Refusal>& refusals();
/// Number of the refusal from 1, 0: they go together.
int refusal_of(const Feature& a, const Feature& b);

struct SceneTexts {
  std::string scene, urdf;
};
/// The scene that has both. `more` comes last and wins.
SceneTexts scene_of(const Feature& a, const Feature& b, const Settings& more = {});

}  // namespace porthos::test::combinations
