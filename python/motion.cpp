#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <optional>

#include "phs/error.h"
#include "python/arrays.h"
#include "python/bind.h"
#include "scene/plot/apart_by_size.h"
#include "scene/plot/motion.h"
#include "scene/plot/plot.h"
#include "scene/plot/svg.h"
#include "scene/run/row_times.h"
#include "scene/session/moved.h"

namespace porthos::python {
namespace {

using namespace scene;
using py::arg;

/// {title with unit: {line: values}}
py::dict as_dict(const std::vector<TracePanel>& panels) {
  py::dict all;
  for (const auto& p : panels) {
    py::dict lines = all.contains(p.what) ? py::dict(all[py::str(p.what)]) : py::dict();
    for (const auto& l : p.lines) lines[py::str(l.name)] = as_array(std::vector<double>(l.value));
    all[py::str(p.what)] = lines;
  }
  return all;
}

/// The series of a Result in memory.
class InMemory final : public Records {
 public:
  explicit InMemory(py::object run)
      : run_(std::move(run)), names_(run_.attr("names").cast<std::vector<std::string>>()) {}
  std::int64_t count() const override { return std::int64_t(py::len(run_.attr("time"))); }
  bool has(const std::string& name) const override { return std::ranges::count(names_, name) > 0; }
  std::vector<std::string> names(const std::string& group) const override {
    std::vector<std::string> list;
    for (const auto& name : names_)
      if (name.starts_with(group + "/")) list.push_back(name.substr(group.size() + 1));
    return list;
  }
  std::string unit(const std::string& name) const override {
    return run_.attr("unit")(name).cast<std::string>();
  }
  std::vector<std::string> columns(const std::string& name) const override {
    if (name != "turns") return {};
    return run_.attr("angles").cast<std::vector<std::string>>();
  }
  std::string text(const std::string&) const override { return ""; }
  void read(const std::string& name, const Piece& f) const override {
    using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
    const auto v = run_[py::str(name)].cast<Array>();
    f(0, v.shape(0), v.ndim() > 1 ? int(v.shape(1)) : 1, v.data());
  }

 private:
  py::object run_;
  std::vector<std::string> names_;
};

py::tuple as_tuple(scene::Motion m) {
  return py::make_tuple(as_array(std::move(m.t)), as_dict(m.panels));
}

ShownOf shown_of(bool bands) { return bands ? scene::Shown::bands : scene::Shown::records; }

py::tuple motion_of(const py::object& run, std::int64_t most, bool bands) {
  auto mechanism = run.attr("mechanism").cast<std::shared_ptr<mechanics::Mechanism>>();
  if (const py::object folder = run.attr("folder"); !folder.is_none())
    return as_tuple(motion_in(folder.cast<std::filesystem::path>(), most, std::move(mechanism),
                              shown_of(bands)));
  const InMemory r(run);
  const scene::Shown shown = shown_of(bands)(r.count(), most);
  return as_tuple({shown.times(r.at("time", shown.rows())),
                   apart_by_size(panels_of(r, *mechanism, {}, shown))});
}

py::tuple states_of_run(const py::object& run, std::int64_t most, bool bands) {
  if (const py::object folder = run.attr("folder"); !folder.is_none())
    return as_tuple(states_in(folder.cast<std::filesystem::path>(), most, shown_of(bands)));
  const InMemory r(run);
  const scene::Shown shown = shown_of(bands)(r.count(), most);
  return as_tuple({shown.times(r.at("time", shown.rows())), states_of(r, shown)});
}

py::list residual_of(const std::vector<double>& t, const std::vector<double>& error,
                     std::optional<double> limit) {
  if (t.size() != error.size()) throw InvalidArgument("expected one error for each time");
  Envelope envelope(t.size() > 1 ? t[1] - t[0] : 1, t.empty() ? 1 : t.back());
  for (size_t i = 0; i < t.size(); ++i) envelope.add(t[i], error[i]);
  constexpr const char* strokes[] = {"line", "band", "guide", "limit"};
  py::list lines;
  for (const TraceLine& l : residual_panel(envelope, limit).lines)
    lines.append(py::make_tuple(
        l.name, strokes[size_t(l.stroke)], as_array(std::vector<double>(l.t)),
        as_array(std::vector<double>(l.value)), as_array(std::vector<double>(l.low))));
  return lines;
}

}  // namespace

void bind_motion(py::module_& m) {
  m.def(
      "moved_in",
      [](const std::filesystem::path& folder) {
        const Moved moved = moved_in(folder);
        py::list springs;
        for (const Spring& s : moved.springs)
          springs.append(
              py::make_tuple(s.name, py::cast(std::const_pointer_cast<vsa::Elastic>(s.energy))));
        return py::make_tuple(moved.mechanisms, springs);
      },
      arg("folder"),
      "The mechanisms of a finished run, one per phase, and names and energies of its actuators, "
      "from the scene and the model in its results; empty for a system without a mechanism.");
  m.def("motion_of", &motion_of, arg("run"), arg("most"), arg("bands"),
        "How the mechanism of a Result moved, over its phases: times, and the panels {title with "
        "unit: {line: values}}. bands: of a part of many records the least and the largest, in "
        "place of one.");
  m.def("states_of", &states_of_run, arg("run"), arg("most"), arg("bands"),
        "The states of a Result of any system, in the same way.");
  m.def("residual_panel", &residual_of, arg("t"), arg("error"), arg("limit") = py::none(),
        "What energy_error.svg shows of a series of relative errors, reduced to 1500 columns: "
        "(name, stroke, t, value, low), stroke one of line, band, guide, limit.");
  m.def("thinned", &thinned, arg("count"), arg("most"),
        "Which of `count` records a line of at most `most` shows: one of each of equal parts, "
        "anywhere in it but always the same.");
  m.def("is_held", &is_held, arg("values"),
        "Whether a series is held between instants, and drawn as stairs.");
  m.def("before_holes", &before_holes, arg("times"),
        "The instants of the rows behind which others are missing [s].");
  m.def(
      "line_colours",
      [] { return std::vector<std::string>(colour::lines.begin(), colour::lines.end()); },
      "Of the lines of every picture, as #rrggbb: those of the SVG files and of the report.");
}

}  // namespace porthos::python
