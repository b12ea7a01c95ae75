// Ensembles of scenes, and their cases as scenes.
#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "python/bind.h"
#include "python/interruptible.h"
#include "scene/compare/auto_method.h"
#include "scene/ensemble/case_run.h"
#include "scene/ensemble/case_scene.h"

namespace porthos::python {
namespace {

using namespace scene;
namespace py = pybind11;
using py::arg;

/// Whether it was interrupted.
bool ensemble_into(const Scene& s, const std::string& out, int threads, bool resume,
                   py::object report) {
  if (threads < 0)
    throw InvalidArgument(fmt::format("threads is {}, expected 1 or more, or 0", threads));
  EnsembleOptions o{.out = out, .resume = resume, .threads = threads};
  EnsembleReport r;
  Advance advance;
  interruptibly(
      [&](const std::atomic<bool>& stop) {
        attach(o, stop, advance);
        r = run_ensemble(Ensemble(with_method_kept(s, out)), o);
      },
      std::move(report), &advance);
  return r.interrupted;
}

std::vector<Assembly> assemblies_of_cases(const Scene& s, std::int64_t count) {
  const Ensemble e(s);
  if (count < 1 || count > e.cases().cases)
    throw InvalidArgument(
        fmt::format("cases is {}, expected 1 to the {} of [ensemble]", count, e.cases().cases));
  std::vector<Assembly> all;
  for (std::int64_t i = 0; i < count; ++i) all.push_back(assembly_of_case(e, i));
  return all;
}

}  // namespace

void bind_ensembles(py::module_& m) {
  m.def(
      "scene_of_case",
      [](const std::filesystem::path& path, std::int64_t index, std::optional<std::string> method,
         std::optional<double> step, std::optional<double> duration) {
        Scene s = std::filesystem::is_directory(path)
                      ? scene_of_case(path, index)
                      : scene_of_case(read_scene(path.string()), index);
        apply(s, {method, step, duration});
        return s;
      },
      arg("path"), arg("index"), py::kw_only(), arg("method") = py::none(),
      arg("step") = py::none(), arg("duration") = py::none(),
      "A case of a scene's [ensemble] as a scene by itself; path: the scene file, or the results "
      "of the ensemble.");
  m.def("assemblies_of_cases", &assemblies_of_cases, arg("scene"), arg("cases"),
        "The first cases of a scene's [ensemble] put together; they share one model where they "
        "differ in numbers of [initial] alone.");
  m.def("run_ensemble", &ensemble_into, arg("scene"), arg("out"), arg("threads") = 0,
        arg("resume") = false, arg("report") = py::none(),
        "Runs the cases of a scene's [ensemble] into a folder; whether it was interrupted.");
}

}  // namespace porthos::python
