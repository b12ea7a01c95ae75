#include "scene/read/changed_scene.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

void check_change(const std::string& path, const Replacement& r) {
  const auto refuse_it = [&](const std::string& why) {
    throw InvalidArgument(fmt::format("{}: change \"{}\": {}", path, r.key, why));
  };
  Names known;
  for (const SchemaKey& k : schema_of("scene")->keys) known.push_back(k.name);
  const std::string first = r.key.substr(0, r.key.find_first_of(".["));
  if (std::ranges::find(known, first) == known.end())
    refuse_it(fmt::format("the scene has no '{}', the nearest known key is '{}'", first,
                          nearest(first, known)));
  for (const double x : r.values)
    if (!std::isfinite(x)) refuse_it(fmt::format("it is {:g}, expected a finite number", x));
}

}  // namespace

Scene read_changed(const std::string& path, std::span<const Replacement> changes) {
  Scene s = read_scene(path);
  std::string text = fmt::format("# {} with changed numbers.\n", path);
  toml::table root = parse_toml(s.text, File{path});
  for (const Replacement& r : changes) {
    check_change(path, r);
    try {
      (void)read_variation(s, std::span(&r, 1));
    } catch (const InvalidArgument& error) {
      std::string why = error.what();  // a changed number has no place in the file
      if (const std::string nowhere = path + ":1:1: "; why.starts_with(nowhere))
        why.erase(0, nowhere.size());
      throw InvalidArgument(fmt::format("{}: change \"{}\": {}", path, r.key, why));
    }
    replace(root, r.key, r.values);
  }
  s = read_variation(s, changes);
  std::ostringstream changed;
  changed << text << root << "\n";
  s.text = changed.str();
  return s;
}

}  // namespace porthos::scene
