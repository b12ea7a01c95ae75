#include "scene/ensemble/case_scene.h"

#include <algorithm>
#include <sstream>

#include "scene/compare/auto_method.h"
#include "scene/files/hdf5_reader.h"
#include "scene/files/text_table.h"
#include "scene/read/scene_texts.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

namespace fs = std::filesystem;

void check_index(std::int64_t index, std::int64_t cases) {
  if (index < 0 || index >= cases)
    throw InvalidArgument(
        fmt::format("there is no case {}, expected one from 0 to {}", index, cases - 1));
}

toml::table& table_in(toml::table& root, const char* name) {
  return *root.insert(name, toml::table{}).first->second.as_table();
}

/// The text of the case, for a reader and for results.
std::string text_of_case(const Scene& nominal, std::span<const Replacement> numbers,
                         std::int64_t index) {
  toml::table root = parse_toml(nominal.text, File{nominal.path});
  for (const Replacement& r : numbers) replace(root, r.key, r.values);
  root.erase("ensemble");
  root.insert_or_assign("title", fmt::format("{}, case {}", nominal.title, index));
  toml::table& integrator = table_in(root, "integrator");
  integrator.insert_or_assign("method", nominal.method);
  integrator.erase("target_energy_error");  // a key of "auto", which has chosen
  if (nominal.step > 0) integrator.insert_or_assign("step", nominal.step);
  toml::table& run = table_in(root, "run");
  run.insert_or_assign("duration", nominal.duration);
  run.insert_or_assign("case", index);
  std::ostringstream text;
  text << "# Case " << index << " of an ensemble: its numbers are in place of the scene's.\n"
       << root << "\n";
  return text.str();
}

Scene read_case(const Scene& nominal, std::span<const Replacement> numbers, std::int64_t index) {
  try {
    Scene s = nominal;
    s.text = text_of_case(nominal, numbers, index);
    return read_variation(s, {});
  } catch (const InvalidArgument& error) {
    throw InvalidArgument(fmt::format("case {}: {}", index, error.what()));
  }
}

/// The scene of an ensemble as its results hold it.
Scene nominal_of(const Hdf5Reader& file, const fs::path& folder) {
  SceneTexts texts{file.text("provenance/scene"), file.text("provenance/model")};
  if (file.datasets().count("provenance/files"))
    texts.files = input_files(file.text("provenance/files"));
  Scene s = read_scene_again((folder / "scene.toml").string(), texts);
  for (const Controller& c : s.controllers)
    if (!c.file.name.empty())
      refuse(c.where, fmt::format("the law '{}' is not in the results of an ensemble, expected the "
                                  "scene file instead of {}",
                                  c.file.name, folder.string()));
  s.method = file.texts("/")["method"];
  s.step = file.numbers("/")["step_s"];
  s.duration = file.numbers("/")["duration_s"];
  return s;
}

/// The quantities of its cases. Those of a table are a column each.
EnsembleScene quantities_of(const Hdf5Reader& file, const Scene& nominal) {
  EnsembleScene e;
  if (file.datasets().count("provenance/table")) {
    for (const auto& key : lines_of(file.texts("inputs")["columns"])) e.quantities.push_back({key});
    return e;
  }
  e.quantities = read_ensemble(nominal, assemble(nominal)).quantities;
  return e;
}

}  // namespace

Scene scene_of_case(const Ensemble& ensemble, std::int64_t index) {
  check_index(index, ensemble.cases().cases);
  const auto values = ensemble.sampler().values(index);
  return read_case(ensemble.scene(), ensemble.sampler().replacements(values), index);
}

Scene scene_of_case(Scene scene, std::int64_t index) {
  if (scene.method == auto_method) scene = with_method_chosen(scene, assemble(scene));
  return scene_of_case(Ensemble(std::move(scene)), index);
}

Scene scene_of_case(const fs::path& results, std::int64_t index) {
  if (!has_ensemble(results))
    throw InvalidArgument(fmt::format(
        "{} has no ensemble.h5, expected the results of a finished ensemble", results.string()));
  const Hdf5Reader file(results / "ensemble.h5");
  check_index(index, std::int64_t(file.numbers("/")["cases"]));
  const Scene nominal = nominal_of(file, results);
  const EnsembleScene e = quantities_of(file, nominal);
  std::vector<double> values(size_t(e.columns()));
  const auto& shape = file.dataset("inputs").shape;
  if (shape.size() != 2 || shape[0] <= index || shape[1] != std::int64_t(values.size()))
    throw InvalidArgument(fmt::format(
        "{}: 'inputs' has not the {} numbers of its [ensemble] for each case, expected the file of "
        "an ensemble as it was written",
        (results / "ensemble.h5").string(), values.size()));
  file.read_rows("inputs", index, 1, values.data());
  return read_case(nominal, CaseSampler(e).replacements(values), index);
}

bool has_ensemble(const fs::path& folder) {
  std::error_code e;
  return fs::is_regular_file(folder / "ensemble.h5", e);
}

}  // namespace porthos::scene
