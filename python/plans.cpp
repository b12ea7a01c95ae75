// Plans of scenes: porthos plan.
#include "python/bind.h"
#include "python/interruptible.h"
#include "scene/files/files.h"
#include "scene/judge/judge_file.h"
#include "scene/plan/plan.h"

namespace porthos::python {
namespace {

namespace py = pybind11;

/// plan.json of a plan into a folder, and whether it was stopped.
py::tuple plan_into(const scene::Scene& s, const scene::Assembly& a, const std::string& out) {
  scene::PlanReport r;
  interruptibly([&](const std::atomic<bool>& stop) { r = scene::plan(s, a, out, &stop); });
  return py::make_tuple(scene::read_file(out + "/plan.json"),
                        r.plan.status == planning::Plan::Status::stopped);
}

/// summary.json of a trajectory of another program, judged into a folder.
std::string judge_into(const std::string& file, const std::string& model, const std::string& map,
                       const std::string& out) {
  interruptibly([&](const std::atomic<bool>&) { scene::judge_file({file, model, map, out, {}}); });
  return scene::read_file(out + "/summary.json");
}

}  // namespace

void bind_plans(py::module_& m) {
  m.def("plan_into", &plan_into, py::arg("scene"), py::arg("assembly"), py::arg("out"),
        "Plans a scene into a folder: (plan.json, whether it was interrupted).");
  m.def("judge_into", &judge_into, py::arg("file"), py::arg("model"), py::arg("map"),
        py::arg("out"), "Judges a trajectory into a folder: summary.json.");
}

}  // namespace porthos::python
