#include "python/motion.h"

#include <pybind11/functional.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <optional>

#include "phs/error.h"
#include "python/arrays.h"
#include "python/bind.h"
#include "scene/plot/motion.h"
#include "scene/plot/plot.h"
#include "scene/plot/svg.h"
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

py::dict motion_of(const std::shared_ptr<const mechanics::Mechanism>& m, std::vector<double> t,
                   std::vector<std::string> turns,
                   const std::function<std::vector<double>(const std::string&)>& rows,
                   std::vector<std::pair<std::string, std::string>> outputs) {
  return as_dict(motion_panels(*m, {std::move(t), std::move(turns), rows, std::move(outputs)}));
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
  m.def(
      "motion_in",
      [](const std::filesystem::path& folder, std::int64_t most,
         std::shared_ptr<mechanics::Mechanism> mechanism) {
        scene::Motion motion = scene::motion_in(folder, most, std::move(mechanism));
        return py::make_tuple(as_array(std::move(motion.t)), as_dict(motion.panels));
      },
      arg("folder"), arg("most"), arg("mechanism") = py::none(),
      "How the mechanism of a finished run moved, over its phases: times, and the panels "
      "{title with unit: {line: values}}. mechanism: of a model made in code.");
  m.def("motion_panels", &motion_of, arg("mechanism"), arg("t"), arg("turns"), arg("rows"),
        arg("outputs") = std::vector<std::pair<std::string, std::string>>{},
        "How a mechanism moved, as {title with unit: {line: values}}. turns: the names behind "
        "the columns of \"turns\"; rows(name): the flat values of a series at the times t, empty "
        "where there is none. outputs: name and unit of the scene's outputs.");
  m.def("residual_panel", &residual_of, arg("t"), arg("error"), arg("limit") = py::none(),
        "What energy_error.svg shows of a series of relative errors, reduced to 1500 columns: "
        "(name, stroke, t, value, low), stroke one of line, band, guide, limit.");
  m.def(
      "line_colours",
      [] { return std::vector<std::string>(colour::lines.begin(), colour::lines.end()); },
      "Of the lines of every picture, as #rrggbb: those of the SVG files and of the report.");
}

}  // namespace porthos::python
