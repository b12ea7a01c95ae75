// Scenes, runs, comparisons and their results.
#include "scene/assemble/assembly.h"

#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cmath>
#include <map>
#include <variant>

#include "phs/network/network.h"
#include "python/arrays.h"
#include "python/bind.h"
#include "python/interruptible.h"
#include "python/keywords.h"
#include "scene/compare/compare.h"
#include "scene/files/files.h"
#include "scene/read/changed_scene.h"
#include "scene/run/columns.h"
#include "scene/run/growth_words.h"
#include "scene/run/statistics.h"
#include "scene/session/extension.h"
#include "scene/session/info.h"
#include "scene/session/memory_run.h"
#include "scene/session/run.h"

namespace porthos::python {
namespace {

using namespace scene;
using py::arg;

/// (summary.json, whether it was interrupted) of a run into a folder.
py::tuple run_into(const Scene& given, const Assembly& a, const std::string& out, bool resume,
                   bool check_symmetry, py::object report, std::optional<double> extend) {
  RunOptions o{.out = out, .resume = resume, .check_symmetry = check_symmetry};
  Scene s = given;
  if (extend) {
    extend_to(s, out, *extend);
    reopen(out, s, a);
    o.resume = true;
  }
  RunReport r;
  Advance advance;
  interruptibly(
      [&](const std::atomic<bool>& stop) {
        attach(o, stop, advance);
        r = run(s, a, o);
      },
      std::move(report), &advance);
  return py::make_tuple(r.interrupted ? "" : read_file(out + "/summary.json"), r.interrupted);
}

/// The columns of a record log by the names they have in run.h5, as views of one array.
class Columns {
 public:
  Columns(const RecordLayout& layout, std::vector<double> rows) : layout_(layout) {
    const size_t n = layout_.size();
    count_ = py::ssize_t(rows.size() / n);
    rows_ = as_array(std::move(rows), {count_, py::ssize_t(n)});
  }
  py::dict named(const phs::Description& d) {
    const auto real = py::dtype::of<double>();
    const auto integer = py::dtype::of<std::int64_t>();
    py::dict named;
    for (const Column& c : columns_of(d, layout_))
      named[py::str(c.name)] =
          py::make_tuple(part(c.first, c.columns, c.integer ? integer : real, c.matrix), c.unit);
    return named;
  }
  /// x of every record, (n, nx).
  py::array states() { return part(layout_.x(), layout_.nx, py::dtype::of<double>(), true); }

 private:
  py::array part(size_t first, size_t columns, const py::dtype& type, bool matrix) {
    const auto width = py::ssize_t(layout_.size() * sizeof(double));
    Shape shape{count_}, strides{width};
    if (matrix) {
      shape.push_back(py::ssize_t(columns));
      strides.push_back(sizeof(double));
    }
    return py::array(type, shape, strides, rows_.data() + first, rows_);
  }
  RecordLayout layout_;
  py::ssize_t count_ = 0;
  py::array_t<double> rows_;
};

/// (summary.json, {name: (array, unit)}, states) of a run in memory.
py::tuple in_memory(const Scene& given, const Assembly& a, bool check_symmetry, py::object report) {
  Scene s = given;
  s.extrema = Extrema::none;  // the columns below have none
  if (!s.events.empty() || s.orbit)
    throw InvalidArgument(
        "a scene with events or an orbit cannot run in memory, whose columns are those of one "
        "mechanism: give it an `out` folder");
  const RecordLayout layout(s, a);
  std::vector<double> rows;
  const auto keep = [&](std::span<const double> row) {
    rows.insert(rows.end(), row.begin(), row.end());
  };
  MemoryOptions o{.record = keep, .check_symmetry = check_symmetry};
  std::string summary;
  Advance advance;
  interruptibly(
      [&](const std::atomic<bool>& stop) {
        attach(o, stop, advance);
        const RunReport r = run_in_memory(s, a, o);
        if (!r.interrupted) summary = summary_json(s, a, r, r.final_state);
      },
      std::move(report), &advance);
  Columns columns(layout, std::move(rows));
  const py::dict named = columns.named(a.model->description());
  return py::make_tuple(summary, named, columns.states());
}

/// (compare.json, compare.txt), and the files in `out` unless it is empty.
py::tuple compare_methods(const Scene& s, const Assembly& a,
                          const std::vector<std::string>& methods, double budget,
                          std::optional<double> duration, const std::string& out,
                          py::object report) {
  CompareOptions o{.methods = methods, .budget_s = budget, .duration = duration};
  check(o);
  if (!out.empty()) make_folder(out);
  Comparison c;
  Advance advance;
  interruptibly(
      [&](const std::atomic<bool>& stop) {
        attach(o, stop, advance);
        c = compare(s, a, o);
        if (!out.empty()) write_comparison(out, s, c);
      },
      std::move(report), &advance);
  return py::make_tuple(comparison_json(s, c), comparison_table(s, c));
}

using Changes = std::map<std::string, std::variant<double, std::vector<double>>>;
std::vector<Replacement> replacements(const Changes& changes) {
  std::vector<Replacement> all;
  for (const auto& [key, value] : changes) {
    const double* one = std::get_if<double>(&value);
    all.push_back({key, one ? std::vector{*one} : std::get<std::vector<double>>(value)});
  }
  return all;
}

Assembly assembly_from(std::shared_ptr<const phs::Model> model, py::object x) {
  const auto start = numbers("x", x, size_t(model->description().nx));
  Assembly a = assembly_of(model, start);
  if (auto m = std::dynamic_pointer_cast<const mechanics::MechanicalModel>(model)) {
    a.mechanism = std::shared_ptr<const mechanics::Mechanism>(m, &m->mechanism());
    a.mechanical = std::move(m);
  }
  return a;
}

py::dict statistics_of(const std::vector<double>& errors, double scale) {
  if (!(scale > 0 && std::isfinite(scale)))
    throw InvalidArgument(fmt::format("scale is {}, expected a positive number", scale));
  ErrorStatistics s, relative;
  for (const double e : errors) {
    if (!std::isfinite(e)) throw InvalidArgument("errors has a number that is not finite");
    s.add(e);
    relative.add(e / scale);
  }
  using namespace py::literals;
  return py::dict("max_abs"_a = s.max_abs(), "rms"_a = s.rms(), "change"_a = s.change(),
                  "growth_exponent"_a = s.growth_exponent(),
                  "drift_is_significant"_a = s.drift_is_significant(),
                  "swing_growth"_a = s.swing_growth(), "words"_a = growth_words(relative));
}

}  // namespace

// NOLINTNEXTLINE(readability-function-size): a list of bindings
void bind_scene(py::module_& m) {
  py::class_<Limits>(
      m, "Limits",
      "Limits of the verdict, relative. None: not checked; no limit at all: the defaults.")
      .def(from_keywords<Limits>())
      .def_readwrite("energy", &Limits::energy)
      .def_readwrite("linear_momentum", &Limits::linear_momentum)
      .def_readwrite("angular_momentum", &Limits::angular_momentum)
      .def_readwrite("quaternion_norm", &Limits::quaternion_norm)
      .def_readwrite("balance", &Limits::balance)
      .def_readwrite("symmetry", &Limits::symmetry)
      .def_readwrite("step_halving", &Limits::step_halving)
      .def_readwrite("orbital", &Limits::orbital)
      .def_readwrite("coupling", &Limits::coupling)
      .def_readwrite("constraints", &Limits::constraints);
  py::class_<Scene>(m, "SceneData",
                    "A scene: what describes a run completely. Every key of a file: docs/scene.md.")
      .def(py::init<>())
      .def_readonly("path", &Scene::path)
      .def_property_readonly("stops", [](const Scene& s) { return s.stops.size(); })
      .def_property_readonly(
          "events",
          [](const Scene& s) {
            std::vector<std::string> list;
            for (const auto& e : s.events) list.push_back(text(e));
            return list;
          },
          "What its [[event]]s do, a text each.")
      .def_readwrite("title", &Scene::title)
      .def_readwrite("method", &Scene::method, "See methods(); 'auto': found by pilot runs.")
      .def_readwrite("step", &Scene::step, "[s]")
      .def_readwrite("duration", &Scene::duration,
                     "[s]; where it is no whole number of steps the last one is shorter.")
      .def_readwrite("record_every", &Scene::record_every, "[s]; of whole steps, one or more.")
      .def_readwrite("centre_stays", &Scene::centre_stays,
                     "Whether the centre of mass of what floats stays in the state. Else, where it "
                     "moves as without the rest, it is integrated apart.")
      .def_readwrite("rtol", &Scene::rtol, "Of reference solvers that work to a tolerance.")
      .def_readwrite("iteration_tolerance", &Scene::iteration_tolerance,
                     "Of implicit methods; 0: to rounding.")
      .def_readwrite("checkpoint_every", &Scene::checkpoint_every, "Wall-clock seconds.")
      .def_readwrite("verify", &Scene::verify);
  py::class_<Assembly>(m, "Assembly", "Everything a run needs, put together from a scene.")
      .def_property_readonly(
          "model", [](const Assembly& a) { return std::const_pointer_cast<phs::Model>(a.model); },
          "What is run.")
      .def_property_readonly(
          "mechanism",
          [](const Assembly& a) {
            return std::const_pointer_cast<mechanics::Mechanism>(a.mechanism);
          },
          "The mechanism in it; None in a system without one.")
      .def_property_readonly(
          "initial", [](const Assembly& a) { return a.initial; },
          "Where a run begins; relative to the centre of mass where that moves "
          "in closed form, see in_world().")
      .def_property_readonly(
          "start",
          [](const Assembly& a) {
            return as_array(phs::with_turns(a.model->description(), a.initial));
          },
          "The numbers of `initial`, nx, angles with their turns.")
      .def_property_readonly(
          "mechanical",
          [](const Assembly& a) {
            return std::const_pointer_cast<mechanics::MechanicalModel>(a.mechanical);
          },
          "The model of the mechanism alone, with its constraints; None without a mechanism.")
      .def(
          "in_world",
          [](const Assembly& a, double t, const phs::State& s) { return WorldView(a)(t, s); },
          arg("t"), arg("state"),
          "A state of the model at time t [s] as the world sees it: places and momenta with "
          "those of the centre of mass, where that moves in closed form; else the state itself.")
      .def_property_readonly(
          "certificates", [](const Assembly& a) { return a.certificates; },
          "Of the scene's controllers, in their order.")
      .def_readonly("notes", &Assembly::notes);

  m.def(
      "read_scene",
      [](py::object path, std::optional<std::string> method, std::optional<double> step,
         std::optional<double> duration, const Changes& change) {
        const std::string file = py::str(path);
        Scene s = change.empty() ? read_scene(file) : read_changed(file, replacements(change));
        apply(s, {method, step, duration});
        return s;
      },
      arg("path"), py::kw_only(), arg("method") = py::none(), arg("step") = py::none(),
      arg("duration") = py::none(), arg("change") = Changes{},
      "Reads and validates a scene. change: numbers by keys as [ensemble.vary] has them. "
      "InvalidArgument, one sentence 'file:line:column: ...', for whatever is wrong in it.");
  m.def("assemble", &assemble, arg("scene"));
  m.def("assembly_of", &assembly_from, arg("model"), arg("x"),
        "A system of the user's own instead of a model file, from the state x at time 0.");
  m.def("info_text", &info_text, arg("scene"), arg("assembly"),
        "What `porthos info` prints: states, ports, invariants, plan, cost of one evaluation.");
  m.def("version_text", &version_text, "What `porthos --version` prints.");
  m.def(
      "run_into", &run_into, arg("scene"), arg("assembly"), arg("out"), arg("resume") = false,
      arg("check_symmetry") = false, arg("report") = py::none(), arg("extend") = py::none(),
      "Runs a scene into a folder: (summary.json, whether it was interrupted). report: called with "
      "(fraction, spent, left). extend: continues the finished run in the folder to this time.");
  m.def("run_in_memory", &in_memory, arg("scene"), arg("assembly"), arg("check_symmetry") = false,
        arg("report") = py::none(),
        "Runs without files: (summary.json, {name: (array, unit)}, states). The names are those of "
        "run.h5.");
  m.def("compare_methods", &compare_methods, arg("scene"), arg("assembly"), arg("methods"),
        arg("budget"), arg("duration"), arg("out"), arg("report") = py::none(),
        "Speed against error: (compare.json, compare.txt), and the files in `out` unless it is "
        "empty.");
  m.def(
      "error_statistics", &statistics_of, arg("errors"), py::kw_only(), arg("scale") = 1.0,
      "Growth and drift of a series of errors at equal intervals of time, as runs are judged: "
      "max_abs, rms, change, growth_exponent (0 bounded or constant, 0.5 random walk, 1 drift or "
      "faster; nan "
      "for less than 33 records, too few swings, too much scatter, or a jump within a record: the "
      "words tell which), drift_is_significant (beyond five "
      "standard errors of a random walk), swing_growth "
      "(how many times larger the scatter is in the last part than in the first, if it rises from "
      "part to part, else 1) and words (what follows \"the error\" in the verdict of a run, a "
      "drift per record). scale: what the errors are relative to, in the words alone; they compare "
      "the error with rounding.");
  bind_motion(m);
  bind_run_file(m);
}

}  // namespace porthos::python
