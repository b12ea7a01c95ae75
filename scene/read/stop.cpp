#include <fmt/format.h>

#include <algorithm>

#include "scene/read/output.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {

std::vector<Stop> read_stops(const Table& scene, const std::vector<Output>& outputs) {
  std::vector<Stop> list;
  const auto known = number_names(outputs);
  scene.each_of("stop", "output", [&](const std::string& output, const Table& t) {
    Stop s;
    s.where = t.where();
    s.output = output;
    if (std::find(known.begin(), known.end(), output) == known.end())
      t.fail("output", fmt::format("is \"{}\", expected a number of an [[output]]: {}", output,
                                   known.empty() ? "there is none"
                                                 : fmt::format("{}", fmt::join(known, ", "))));
    const int given = t.has("above") + t.has("below");
    if (given != 1)
      refuse(t.where(),
             fmt::format("[[stop]] has {} of the keys above and below, expected one", given));
    s.above = t.has("above");
    s.limit = t.number(s.above ? "above" : "below");
    if (t.has("after")) s.after = t.seconds("after");
    const std::string outcome = t.choice("outcome");
    s.fails = outcome == "fail";
    s.ends = outcome != "judge";
    s.name = t.has("name") ? t.text("name", "a name") : text(s);
    list.push_back(std::move(s));
  });
  return list;
}

std::string text(const Stop& s) {
  return fmt::format("{} {} {:g}", s.output, s.above ? "above" : "below", s.limit);
}

SchemaTable stop_table() {
  using namespace keys;
  return {"stop",
          "[[stop]]",
          "Ends the run at the instant at which an output passes a value, or judges it by that.",
          {text("output", required, "a number of an [[output]]: \"height\", \"tip.z\""),
           number("above", "its unit", "one of both", "ends once it is above"),
           number("below", "its unit", "one of both", "ends once it is below"),
           number("after", "s", "0", "not before this time"),
           word("outcome", {"end", "fail", "judge"}, "\"end\"",
                "the run ends and is judged, or it fails; judge: it goes on, and fails at its end"),
           text("name", "the condition", "for reports")}};
}

}  // namespace porthos::scene
